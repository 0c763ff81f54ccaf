#include "nodes.h"

namespace palpate::godot {
namespace {

enum HandProperty : size_t { kFollowsDevice, kReach };

}  // namespace

Variant HandNode::get(size_t property) const {
  const Variant values[] = {follows_device_, reach_m_, force_n_, proxy_, is_touching_, cause_};
  return values[property];
}

void HandNode::set(size_t property, const Variant& value) {
  if (property == kFollowsDevice) follows_device_ = value;
  if (property == kReach) reach_m_ = value;
}

void HandNode::process() {
  if (!scene_ || scene_->hand != this || !scene_->session()) return;
  if (!follows_device() && !in_editor()) {
    const HandPoint place_m = scene_->in_device(
        scene_->in_palpate(self().call("get_global_position").as<EngineVector>()));
    scene_->link.hold(&place_m);
  }
  const PalState* const state = scene_->state();
  if (!state) return;
  if (follows_device() && !in_editor())
    self().call("set_global_position", scene_->placed(state->hand_m));
  force_n_ = scene_->turned(state->force_n);
  proxy_ = scene_->placed(state->proxy_m);
  if (const bool touches = state->in_contact != 0; touches != is_touching_) {
    is_touching_ = touches;
    emit("touching", touches);
  }
  if (state->cause != cause_) {
    cause_ = state->cause;
    emit("cause_changed", cause_, state->cause_sentence);
  }
}

void HandNode::notified(int what) {
  if (what == kEntersTree) {
    scene_ = SceneNode::above(*this);
    if (!scene_) warn("A PalpateHand stands below a PalpateScene");
    if (scene_ && scene_->hand) warn("A PalpateScene has one hand: this PalpateHand does nothing");
    if (scene_ && !scene_->hand) scene_->hand = this;
    // After all scripts have moved the hand.
    self().call("set_process_priority", 100);
    self().call("set_process_internal", true);
  }
  if (what == kInternalProcess) process();
  if (what == kLeavesTree) {
    if (scene_ && scene_->hand == this) {
      scene_->hand = nullptr;
      scene_->link.hold(nullptr);
    }
    scene_ = nullptr;
  }
}

const ClassRow& HandNode::class_row() {
  static const ClassRow row{
      "PalpateHand",
      "Node3D",
      "The hand in the PalpateScene above: its global position feels.",
      []() -> std::unique_ptr<EngineNode> { return std::make_unique<HandNode>(); },
      {},
      {{"touching", {{"is_touching", GDEXTENSION_VARIANT_TYPE_BOOL}}},
       {"cause_changed",
        {{"word", GDEXTENSION_VARIANT_TYPE_STRING},
         {"sentence", GDEXTENSION_VARIANT_TYPE_STRING}}}},
      {{.name = "follows_device",
        .type = GDEXTENSION_VARIANT_TYPE_BOOL,
        .help = "The node goes where the hand on the force device is, which the scene's device "
                "names; else the node's place is the hand"},
       {.name = "reach_m",
        .type = GDEXTENSION_VARIANT_TYPE_FLOAT,
        .hint = 1,
        .hint_text = "0.01,10,0.001,suffix:m",
        .help = "How far the hand reaches from the middle of the device's space; a sequence is "
                "scaled down to it unless true_size is set"},
       {.name = "force",
        .type = GDEXTENSION_VARIANT_TYPE_VECTOR3,
        .usage = 0,
        .help = "On the hand, N, along the axes of Godot's world"},
       {.name = "proxy",
        .type = GDEXTENSION_VARIANT_TYPE_VECTOR3,
        .usage = 0,
        .help = "The place on the surface that is touched, in Godot's world"},
       {.name = "is_touching", .type = GDEXTENSION_VARIANT_TYPE_BOOL, .usage = 0, .help = ""},
       {.name = "cause",
        .type = GDEXTENSION_VARIANT_TYPE_STRING,
        .usage = 0,
        .help = "Why the force is not the scene's, a word; empty: it is the scene's"}}};
  return row;
}

}  // namespace palpate::godot
