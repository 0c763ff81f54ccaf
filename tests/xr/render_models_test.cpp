// The shapes of controllers as the runtime gives them (XR_EXT_interaction_render_model): which are
// asked for, where they are, what moves, and what comes of refusals.

#include "tests/xr/made_glb.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using xr::HeadsetState;

class XrRenderModels : public XrTest {
 protected:
  const std::vector<xr::HeldModel>& start() {
    headset();
    EXPECT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
    step();
    return held();
  }
  const std::vector<xr::HeldModel>& held() { return source.last->held; }
  void hold(int hand, XrVector3f at) {
    runtime().script_hand(hand, [at](XrTime) { return XrPosef{{0, 0, 0, 1}, at}; });
  }
  int asked() { return runtime().calls("xrCreateRenderModelEXT"); }
};

TEST_F(XrRenderModels, AreWhereTheControllersAreAndMoveWithThem) {
  hold(0, {-0.2F, 1.1F, -0.3F});
  hold(1, {0.2F, 1.2F, -0.4F});
  ASSERT_EQ(start().size(), 2u);
  EXPECT_TRUE(headset_report().controller_models);
  const Pose world_from_base = headset_pointer()->colocation().world_from_base();
  for (size_t k = 0; k < 2; ++k) {
    const glm::dvec3 at = k == 0 ? glm::dvec3(-0.2, 1.1, -0.3) : glm::dvec3(0.2, 1.2, -0.4);
    EXPECT_LT(glm::distance(held()[k].world_from_model.position_m, world_from_base(at)), 1e-6);
    EXPECT_EQ(held()[k].asset->glb, made_controller());
    EXPECT_THAT(held()[k].asset->moving_nodes, ElementsAre("trigger"));
    ASSERT_EQ(held()[k].nodes.size(), 1u);
    EXPECT_FLOAT_EQ(float(held()[k].nodes[0].parent_from_node.position_m.y), -0.04F);
    EXPECT_TRUE(held()[k].nodes[0].visible);
  }
  const auto before = held()[1].asset;
  hold(1, {0.3F, 1.2F, -0.4F});
  runtime().setup().trigger_y = -0.03F;
  runtime().setup().shows_trigger = false;
  step();
  ASSERT_EQ(held().size(), 2u);
  EXPECT_LT(glm::distance(held()[1].world_from_model.position_m,
                          world_from_base(glm::dvec3(0.3, 1.2, -0.4))),
            1e-6);
  EXPECT_FLOAT_EQ(float(held()[1].nodes[0].parent_from_node.position_m.y), -0.03F);
  EXPECT_FALSE(held()[1].nodes[0].visible);
  EXPECT_EQ(held()[1].asset, before) << "what is known is not copied again";
  EXPECT_EQ(asked(), 2);
}

TEST_F(XrRenderModels, FollowWhatIsTakenUpAndPutDown) {
  runtime().script_hand(0, nullptr);
  hold(1, {0.2F, 1.2F, -0.4F});
  ASSERT_EQ(start().size(), 1u);
  hold(0, {-0.2F, 1.1F, -0.3F});
  step();
  EXPECT_EQ(held().size(), 1u) << "nobody has said so yet";
  runtime().change_models();
  step();
  step();
  EXPECT_EQ(held().size(), 2u);
  EXPECT_EQ(asked(), 2);
  runtime().script_hand(1, nullptr);
  step();
  EXPECT_EQ(held().size(), 1u) << "it has no place any more";
  runtime().change_models();
  step();
  step();
  EXPECT_EQ(held().size(), 1u);
}

TEST_F(XrRenderModels, AreNotAskedForWithoutTheExtension) {
  std::erase(runtime().setup().extensions, "XR_EXT_interaction_render_model");
  EXPECT_THAT(start(), IsEmpty());
  EXPECT_FALSE(headset_report().controller_models);
  EXPECT_EQ(headset_report().no_controller_models, "");
  EXPECT_EQ(runtime().calls("xrEnumerateInteractionRenderModelIdsEXT"), 0);
}

TEST_F(XrRenderModels, ThatAreRefusedAreLeftOutAndSaidOnce) {
  runtime().inject_always("xrGetRenderModelAssetDataEXT", XR_ERROR_RUNTIME_FAILURE);
  EXPECT_THAT(start(), IsEmpty());
  EXPECT_EQ(headset_report().no_controller_models, "xrGetRenderModelAssetDataEXT returned -2");
  EXPECT_FALSE(headset_report().controller_models);
  step();
  EXPECT_EQ(headset_report().state, HeadsetState::kFocused);
  EXPECT_EQ(runtime().calls("xrGetRenderModelAssetDataEXT"), 1);
}

TEST_F(XrRenderModels, OneThatIsGoneAgainIsPassedOver) {
  runtime().script_hand(0, nullptr);
  ASSERT_EQ(start().size(), 1u);
  hold(0, {-0.2F, 1.1F, -0.3F});
  // It is asked for twice: a controller that is taken up has a profile, too.
  for (int k = 0; k < 2; ++k) runtime().inject("xrCreateRenderModelEXT", 1, XrResult(-1000300000));
  for (const size_t found : {1u, 2u}) {
    runtime().change_models();
    step();
    step();
    EXPECT_EQ(held().size(), found);
  }
  EXPECT_EQ(headset_report().no_controller_models, "");
}

TEST_F(XrRenderModels, AreNotShownWhileTheInputGoesElsewhere) {
  ASSERT_EQ(start().size(), 2u);
  runtime().announce(XR_SESSION_STATE_VISIBLE);
  step();
  step();
  EXPECT_THAT(held(), IsEmpty());
}

}  // namespace
}  // namespace palpate::test
