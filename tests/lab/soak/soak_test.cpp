// Twenty seconds of the soak. The test does not measure time: the machine may be busy.
#include <gtest/gtest.h>

#include <numeric>

#include "tests/lab/soak/soak.h"

namespace palpate::soak {
namespace {

TEST(Soak, KeepsItsPromisesWhateverTheDeviceDoes) {
  Options options;
  options.seconds = 20.0;
  options.seed = 20260705;
  const Report report = run(options);
  SCOPED_TRACE(text(report));
  for (const std::string& what : report.broken) ADD_FAILURE() << what;
  // The run must have had ticks, contact and faults; else the test checks nothing.
  EXPECT_GT(report.ticks, 1000U);
  EXPECT_GT(report.touching, 0U);
  EXPECT_GT(report.injected.all(), 1U);
  EXPECT_GT(report.scenes, 5U);
  // Every tick has a cause, which may be kNone.
  EXPECT_EQ(std::accumulate(report.causes.begin(), report.causes.end(), uint64_t(0)), report.ticks);
  // Scenes and fields that are no longer used are freed: a heart with four fields is 9 MB.
  EXPECT_LT(report.heap_end_bytes, report.heap_early_bytes + 20'000'000);
}

}  // namespace
}  // namespace palpate::soak
