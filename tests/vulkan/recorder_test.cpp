#include "compute/vulkan/recorder.h"

#include "compute/motion/bricks.h"
#include "shaders/interface/motion.h"
#include "tests/support/device.h"
#include "tests/support/images.h"
#include "tests/support/random_fields.h"
#include "tests/support/tolerances.h"

/// The recorder's guarantees, with a kernel whose result depends on the order of execution: blend
/// with all cells flagged is a smoothing, and n of them in a row are n smoothings.
namespace palpate::test {
namespace {

using vulkan::Recorder;

class VulkanRecorder : public DeviceTest {
 protected:
  void SetUp() override {
    DeviceTest::SetUp();
    if (!context()) return;
    u = vectors_of(as_stored(texels_of(random_vectors(size, 7, 1.0)), Format::kRgba32));
    flags = upload(context(), oracle::Texels(size, glm::dvec4(1.0)), Format::kR32);
    a = upload(context(), texels_of(u), Format::kRgba32);
    b = filled(context(), size, Format::kRgba32, 0.0);
    list = upload_bricks(context(), bricks);
  }
  void TearDown() override {
    // Freed before the messages of the validation layers are read.
    for (DeviceImage* image : {&flags, &a, &b}) *image = {};
    list = {};
    DeviceTest::TearDown();
  }

  void smooth(Recorder& recorder, const DeviceImage& from, const DeviceImage& to) {
    const vulkan::Sampler& nearest = kernels()->nearest();
    recorder.dispatch(kernels()->blend(),
                      {list, {flags.image, nearest}, {from.image, nearest}, to.image},
                      shaders::BlendPush{glm::ivec4(size, 0)}, slice_groups(bricks));
  }

  oracle::Vectors smoothed(int times) const {
    oracle::Vectors result = u;
    for (int k = 0; k < times; ++k) {
      result = oracle::blend(oracle::Scalars(size, 1.0), result);
    }
    return result;
  }

  void expect_equal(const DeviceImage& image, const oracle::Vectors& expected) {
    const oracle::Texels actual = download(context(), image);
    for (size_t i = 0; i < actual.values.size(); ++i)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(actual.values[i][c], expected.values[i][c], kSingle) << i;
  }

  const glm::ivec3 size{17, 9, 10};
  const BrickList bricks = all_bricks(size);
  oracle::Vectors u;
  DeviceImage flags, a, b;
  vulkan::Buffer list;
};

TEST_F(VulkanRecorder, LetsEveryDispatchWaitForTheOneBefore) {
  Recorder recorder(context());
  for (int k = 0; k < 5; ++k) {
    smooth(recorder, a, b);
    smooth(recorder, b, a);
  }
  recorder.run();
  expect_equal(a, smoothed(10));
}

TEST_F(VulkanRecorder, OrdersCopiesAndDispatches) {
  const vulkan::Buffer through(context(), size_t(size.x) * size_t(size.y) * size_t(size.z) * 16);
  Recorder recorder(context());
  smooth(recorder, a, b);
  recorder.copy(b.image, through);
  recorder.copy(through, a.image);
  smooth(recorder, a, b);
  smooth(recorder, b, a);
  recorder.copy(a.image, through);
  recorder.copy(through, b.image);
  smooth(recorder, b, a);
  recorder.run();
  expect_equal(a, smoothed(4));
}

TEST_F(VulkanRecorder, RunsWhatWasRecordedAsOftenAsAsked) {
  Recorder recorder(context());
  smooth(recorder, a, b);
  smooth(recorder, b, a);
  for (int k = 0; k < 3; ++k) recorder.run();
  expect_equal(a, smoothed(6));
}

TEST_F(VulkanRecorder, StartsWithoutWaiting) {
  Recorder recorder(context());
  smooth(recorder, a, b);
  recorder.start();
  recorder.wait();
  // Nothing to wait for: returns.
  recorder.wait();
  expect_equal(b, smoothed(1));
  recorder.start();
  // Destroyed while the work may still run: it waits.
}

TEST_F(VulkanRecorder, RunsIndependentWorkTogetherAndOrdersWhatFollows) {
  const DeviceImage c = filled(context(), size, Format::kRgba32, 0.0);
  const DeviceImage d = filled(context(), size, Format::kRgba32, 0.0);
  Recorder recorder(context());
  smooth(recorder, a, b);
  recorder.begin_concurrent();
  smooth(recorder, b, c);
  smooth(recorder, b, d);
  recorder.end_concurrent();
  smooth(recorder, d, b);
  recorder.run();
  expect_equal(c, smoothed(2));
  expect_equal(b, smoothed(3));
}

TEST_F(VulkanRecorder, RefusesMoreDispatchesThanAnnounced) {
  Recorder recorder(context(), 2);
  smooth(recorder, a, b);
  smooth(recorder, b, a);
  EXPECT_THROW(smooth(recorder, a, b), vulkan::Failure);
}

TEST_F(VulkanRecorder, StampsTimesUnderTheirNamesInOrder) {
  Recorder recorder(context());
  EXPECT_TRUE(recorder.timestamps().empty());
  recorder.stamp("begin");
  smooth(recorder, a, b);
  recorder.stamp("smoothed");
  smooth(recorder, b, a);
  recorder.stamp("again");
  recorder.run();
  const std::vector<Recorder::TimerStamp> stamps = recorder.timestamps();
  ASSERT_EQ(stamps.size(), 3U);
  EXPECT_EQ(stamps[0].name, "begin");
  EXPECT_EQ(stamps[1].name, "smoothed");
  EXPECT_EQ(stamps[2].name, "again");
  EXPECT_EQ(stamps[0].seconds, 0.0);
  EXPECT_LE(stamps[0].seconds, stamps[1].seconds);
  EXPECT_LE(stamps[1].seconds, stamps[2].seconds);
}

/// The absence of messages, which every other test requires, is significant: a missing barrier is
/// reported.
TEST_F(VulkanRecorder, IsHeardByValidationWhenABarrierIsMissing) {
  vulkan::ContextOptions options;
  options.validation = true;
  Result<std::shared_ptr<vulkan::Context>> opened = vulkan::Context::open(options);
  ASSERT_TRUE(opened);
  const std::shared_ptr<vulkan::Context> own = *opened;
  MotionKernels own_kernels(own);
  const vulkan::Buffer own_list = upload_bricks(own, bricks);
  const DeviceImage own_flags = filled(own, size, Format::kR32, 1.0);
  const DeviceImage from = filled(own, size, Format::kRgba32, 1.0);
  const DeviceImage to = filled(own, size, Format::kRgba32, 1.0);
  const shaders::BlendPush push{glm::ivec4(size, 0)};
  const vulkan::Sampler& nearest = own_kernels.nearest();
  {
    Recorder recorder(own);
    recorder.begin_concurrent();
    recorder.dispatch(own_kernels.blend(),
                      {own_list, {own_flags.image, nearest}, {from.image, nearest}, to.image}, push,
                      slice_groups(bricks));
    recorder.dispatch(own_kernels.blend(),
                      {own_list, {own_flags.image, nearest}, {to.image, nearest}, from.image}, push,
                      slice_groups(bricks));
    recorder.end_concurrent();
    recorder.run();
  }
  // As older and as newer layers word it.
  EXPECT_THAT(own->validation_messages(),
              ::testing::Contains(::testing::AnyOf(::testing::HasSubstr("SYNC-HAZARD"),
                                                   ::testing::HasSubstr("hazard detected"))));
}

}  // namespace
}  // namespace palpate::test
