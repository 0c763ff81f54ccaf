// What arrives at the runtime against what the renderer itself reads back: the same device, the
// same bits. Behind Vulkan's validation layers.
#include "module/xr/volume_source.h"

#include <cmath>

#include "compute/volume/phantom.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

class VolumeSourceTest : public XrTest {};

std::shared_ptr<const MovingVolume> small_heart() {
  VolumeSpec spec;
  spec.name = "heart";
  VolumeData data;
  data.frames = heart_phantom(32, 2);
  auto built = build(spec, std::move(data));
  return built ? std::make_shared<const MovingVolume>(std::move(*built)) : nullptr;
}

TEST_F(VolumeSourceTest, HandsOverWhatTheRendererDrawsForEachEyeWithItsDepth) {
  const auto heart = small_heart();
  ASSERT_TRUE(heart);
  const std::vector<std::shared_ptr<const MovingVolume>> volumes{heart};
  xr::Scenery last;
  std::array<Eye, 2> eyes;
  xr::VolumeSource drawing([&](const xr::Frame& frame) -> std::optional<xr::Scenery> {
    for (size_t eye = 0; eye < 2; ++eye) eyes[eye] = xr::eye_of(frame.eyes[eye]);
    last.volumes = volumes;
    last.scene = {};
    ViewVolume shown;
    shown.data = heart;
    shown.world_from_volume.translation_m = {0.0, 1.6, -0.3};
    shown.pointer.phase = 0.25;
    shown.look = *preset_look("CT heart");
    last.scene.volumes = {shown};
    return last;
  });
  runtime().setup().keep_pictures = true;
  runtime().setup().view_width = 160;
  runtime().setup().view_height = 120;
  xr::HeadsetOptions options;
  options.validation = true;
  xr::Headset headset(options, drawing);
  // The renderer is made beside the frames: until it is there they have no picture.
  uint64_t drawn = 0;
  for (int k = 0; k < 60'000 && drawn < 3; ++k) {
    now_ns_ += 11'111'111;
    drawn = headset.step(now_ns_).drawn;
    if (drawn == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(drawn, 3u) << drawing.trouble();
  const std::vector<fake::Picture> pictures = runtime().pictures();
  ASSERT_EQ(pictures.size(), 2u);
  auto renderer = VolumeRenderer::make(headset.context(), {.most = {160, 120}});
  ASSERT_TRUE(renderer);
  ASSERT_TRUE((*renderer)->set_volumes(volumes));
  const PictureSize size = drawing.size();
  ASSERT_EQ(int(pictures[0].width), size.width);
  ASSERT_EQ(int(pictures[0].height), size.height);
  ASSERT_TRUE((*renderer)->start(last.scene, eyes, size));
  for (int eye = 0; eye < 2; ++eye) {
    const auto expected = (*renderer)->read_back(eye);
    ASSERT_TRUE(expected);
    const fake::Picture& shown = pictures[size_t(eye)];
    EXPECT_EQ(shown.rgba, expected->colours) << "eye " << eye;
    EXPECT_EQ(shown.depth, expected->depths) << "eye " << eye;
    // Reversed depth without an end: near / depth. The heart's middle is 0.3 m away.
    EXPECT_TRUE(std::isinf(shown.near_m));
    const float nearest = *std::max_element(shown.depth.begin(), shown.depth.end());
    EXPECT_GT(shown.far_m / nearest, 0.2F);
    EXPECT_LT(shown.far_m / nearest, 0.3F);
  }
  EXPECT_NE(pictures[0].rgba, pictures[1].rgba);
  EXPECT_TRUE(headset.context()->validation_active());
  EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
}

TEST_F(VolumeSourceTest, MakesEverythingAnewOnTheDeviceOfARuntimeThatInsistsOnItsOwn) {
  const auto heart = small_heart();
  const std::vector<std::shared_ptr<const MovingVolume>> volumes{heart};
  xr::VolumeSource drawing([&](const xr::Frame&) {
    xr::Scenery scenery;
    scenery.volumes = volumes;
    ViewVolume shown;
    shown.data = heart;
    shown.world_from_volume.translation_m = {0.0, 1.6, -0.3};
    shown.look = *preset_look("CT heart");
    scenery.scene.volumes = {shown};
    return std::optional(scenery);
  });
  runtime().setup().own_devices_only = true;
  xr::HeadsetOptions options;
  options.validation = true;
  xr::Headset headset(options, drawing);
  const auto draw_some = [&](uint64_t more) {
    const uint64_t wanted = headset.report().drawn + more;
    for (int k = 0; k < 60'000 && headset.report().drawn < wanted; ++k) {
      now_ns_ += 11'111'111;
      headset.step(now_ns_);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return headset.report().drawn >= wanted;
  };
  ASSERT_TRUE(draw_some(2));
  const auto first = headset.context();
  runtime().lose_instance();
  ASSERT_TRUE(draw_some(2)) << headset.report().problem.message;
  EXPECT_NE(headset.context(), first);
  EXPECT_EQ(headset.report().sessions, 2u);
  EXPECT_THAT(first->validation_messages(), ::testing::IsEmpty());
  EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace palpate::test
