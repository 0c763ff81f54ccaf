// Thousands of damaged fronts, from a fixed seed: a front that another version stored, or that a
// full disk cut off, must be refused with a message.
#include <gtest/gtest.h>

#include "integration/app/choice/motion_front.h"
#include "tests/lab/tests/studies/fuzz/front_bytes.h"
#include "tests/support/mutator.h"

namespace palpate::studies {
namespace {

TEST(FrontFuzz, ReaderHolds) {
  const app::MotionFront front{"a device",
                               "palpate 1",
                               "a pair",
                               262144,
                               {{"fast", 0.3, 0.2}, {"balanced, half the iterations", 1.5, 0.1}}};
  test::Mutator mutator({"-1", "0", "1e308", "1e-320", "nan", "null", "true", "[]", "{", "\"", ",",
                         "18446744073709551616", "best", "classic", "\xff"});
  mutator.run(app::front_text(front), 4000, fuzz::parse_front_bytes);
}

}  // namespace
}  // namespace palpate::studies
