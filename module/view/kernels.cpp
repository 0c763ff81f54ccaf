#include "module/view/kernels.h"

#include <utility>

#include "shaders/interface/view.h"
#include "spirv/view/between.h"
#include "spirv/view/brick.h"
#include "spirv/view/carry.h"
#include "spirv/view/curve.h"
#include "spirv/view/distance.h"
#include "spirv/view/light.h"
#include "spirv/view/light_density.h"
#include "spirv/view/light_halve.h"
#include "spirv/view/list.h"
#include "spirv/view/mark.h"
#include "spirv/view/mesh_colours.h"
#include "spirv/view/meshes.h"
#include "spirv/view/motion_at.h"
#include "spirv/view/motion_blend.h"
#include "spirv/view/need.h"
#include "spirv/view/prefilter.h"
#include "spirv/view/ranges.h"
#include "spirv/view/raycast.h"
#include "spirv/view/things.h"
#include "spirv/view/track.h"

namespace palpate::view {

using namespace view_shaders;

Kernels::Kernels(std::shared_ptr<vulkan::Context> context)
    : context_(std::move(context)),
      group_(context_->is_cpu() ? 2 : 1),
      nearest_(context_, VK_FILTER_NEAREST),
      linear_(context_, VK_FILTER_LINEAR) {}

template <size_t N>
const vulkan::Kernel& Kernels::get(const uint32_t (&spirv)[N], uint32_t push_bytes,
                                   std::vector<uint32_t> specialisation) {
  const std::lock_guard lock(mutex_);
  vulkan::Kernel& kernel = kernels_[{spirv, specialisation}];
  if (!kernel.pipeline()) {
    vulkan::KernelOptions options;
    options.spirv = spirv;
    options.push_bytes = push_bytes;
    options.specialisation = std::move(specialisation);
    kernel = vulkan::Kernel(context_, options);
  }
  return kernel;
}

const vulkan::Kernel& Kernels::prefilter() {
  return get(k_view_prefilter, sizeof(PrefilterPush));
}
const vulkan::Kernel& Kernels::motion_at(bool texels) {
  return get(k_view_motion_at, sizeof(MotionAtPush), {texels ? 1U : 0U});
}
const vulkan::Kernel& Kernels::motion_blend() {
  return get(k_view_motion_blend, sizeof(MotionBlendPush));
}
const vulkan::Kernel& Kernels::track() {
  return get(k_view_track, sizeof(TrackPush));
}
const vulkan::Kernel& Kernels::curve() {
  return get(k_view_curve, sizeof(PrefilterPush));
}
const vulkan::Kernel& Kernels::ranges(bool curved) {
  return get(k_view_ranges, sizeof(RangesPush), {curved ? 1U : 0U});
}
const vulkan::Kernel& Kernels::mark(bool carried) {
  return get(k_view_mark, sizeof(MarkPush), {carried ? 1U : 0U});
}
const vulkan::Kernel& Kernels::list() {
  return get(k_view_list, sizeof(BricksPush), {group_});
}
const vulkan::Kernel& Kernels::need() {
  return get(k_view_need, sizeof(BricksPush));
}
const vulkan::Kernel& Kernels::brick(bool moves, bool blends) {
  return get(k_view_brick, sizeof(BrickPush), {moves ? 1U : 0U, blends ? 1U : 0U, group_});
}
const vulkan::Kernel& Kernels::carry() {
  return get(k_view_carry, sizeof(BrickPush));
}
const vulkan::Kernel& Kernels::distance(int axis) {
  return get(k_view_distance, sizeof(BricksPush), {uint32_t(axis)});
}
const vulkan::Kernel& Kernels::things(int pass) {
  return get(k_view_things, 0, {uint32_t(pass)});
}
const vulkan::Kernel& Kernels::meshes(int pass) {
  return get(k_view_meshes, 0, {uint32_t(pass)});
}
const vulkan::Kernel& Kernels::mesh_colours() {
  return get(k_view_mesh_colours, 0);
}
const vulkan::Kernel& Kernels::light_density(bool texels) {
  return get(k_view_light_density, sizeof(LightDensityPush), {texels ? 1U : 0U});
}
const vulkan::Kernel& Kernels::light_halve() {
  return get(k_view_light_halve, sizeof(LightHalvePush));
}
const vulkan::Kernel& Kernels::light() {
  return get(k_view_light, 0);
}
const vulkan::Kernel& Kernels::raycast(const RaycastChoices& choices) {
  const auto bit = [](bool is) { return is ? 1U : 0U; };
  return get(k_view_raycast, sizeof(RaycastPush),
             {uint32_t(choices.volumes), bit(choices.things), bit(choices.skip), bit(choices.count),
              bit(choices.masked), bit(choices.texels), choices.backdrop, bit(choices.lit),
              bit(choices.refines)});
}
const vulkan::Kernel& Kernels::between(const RaycastChoices& choices) {
  return get(k_view_between, 0,
             {choices.things ? 1U : 0U, choices.masked ? 1U : 0U, choices.backdrop});
}

}  // namespace palpate::view
