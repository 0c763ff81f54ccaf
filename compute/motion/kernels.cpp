#include "compute/motion/kernels.h"

#include "shaders/interface/motion.h"
#include "spirv/motion/blend.h"
#include "spirv/motion/classic_force.h"
#include "spirv/motion/confidence.h"
#include "spirv/motion/coupled_choice.h"
#include "spirv/motion/downsample.h"
#include "spirv/motion/folds.h"
#include "spirv/motion/gauss.h"
#include "spirv/motion/matching_cost.h"
#include "spirv/motion/measure.h"
#include "spirv/motion/moments.h"
#include "spirv/motion/normal_equations.h"
#include "spirv/motion/normalise.h"
#include "spirv/motion/pack.h"
#include "spirv/motion/smooth_cost.h"
#include "spirv/motion/tv_dual.h"
#include "spirv/motion/tv_primal.h"
#include "spirv/motion/update.h"
#include "spirv/motion/update_two.h"
#include "spirv/motion/upsample.h"

namespace palpate {

MotionKernels::MotionKernels(std::shared_ptr<vulkan::Context> context)
    : context_(std::move(context)),
      nearest_(context_, VK_FILTER_NEAREST),
      linear_(context_, VK_FILTER_LINEAR) {}

/// `bindings` names the kinds in order: b buffer, s sampled image, i storage image.
template <size_t N>
const vulkan::Kernel& MotionKernels::get(const uint32_t (&spirv)[N], const char* bindings,
                                         uint32_t push_bytes,
                                         std::vector<uint32_t> specialisation) {
  const std::lock_guard lock(mutex_);
  vulkan::Kernel& kernel = kernels_[{spirv, specialisation}];
  if (!kernel.pipeline()) {
    vulkan::KernelOptions options;
    options.spirv = spirv;
    for (const char* kind = bindings; *kind; ++kind) {
      options.bindings.push_back(*kind == 'b'   ? vulkan::BindingKind::kBuffer
                                 : *kind == 's' ? vulkan::BindingKind::kSampledImage
                                                : vulkan::BindingKind::kStorageImage);
    }
    options.push_bytes = push_bytes;
    options.specialisation = std::move(specialisation);
    kernel = vulkan::Kernel(context_, options);
  }
  return kernel;
}

using namespace shaders;

const vulkan::Kernel& MotionKernels::downsample() {
  return get(k_motion_downsample, "si", sizeof(DownsamplePush));
}
const vulkan::Kernel& MotionKernels::moments() {
  return get(k_motion_moments, "si", sizeof(MomentsPush));
}
const vulkan::Kernel& MotionKernels::gauss() {
  return get(k_motion_gauss, "bsi", sizeof(GaussPush));
}
const vulkan::Kernel& MotionKernels::normalise() {
  return get(k_motion_normalise, "ssi", sizeof(NormalisePush));
}
const vulkan::Kernel& MotionKernels::pack(bool masked) {
  return get(k_motion_pack, "ssi", sizeof(PackPush), {masked ? 1U : 0U});
}
const vulkan::Kernel& MotionKernels::normal_equations(glm::ivec3 cell) {
  return get(k_motion_normal_equations, "bsssiiisss", sizeof(NormalEquationsPush),
             {uint32_t(cell.x), uint32_t(cell.y), uint32_t(cell.z)});
}
const vulkan::Kernel& MotionKernels::update() {
  return get(k_motion_update, "bssssi", sizeof(UpdatePush));
}
const vulkan::Kernel& MotionKernels::update_two() {
  return get(k_motion_update_two, "bssssssssi", sizeof(UpdateTwoPush));
}
const vulkan::Kernel& MotionKernels::tv_primal(bool last) {
  return get(k_motion_tv_primal, "bsssssii", sizeof(TotalVariationPush), {last ? 1U : 0U});
}
const vulkan::Kernel& MotionKernels::tv_dual() {
  return get(k_motion_tv_dual, "bssssiii", sizeof(TotalVariationPush));
}
const vulkan::Kernel& MotionKernels::upsample() {
  return get(k_motion_upsample, "sii", sizeof(UpsamplePush));
}
const vulkan::Kernel& MotionKernels::measure() {
  return get(k_motion_measure, "bssisb", sizeof(MeasurePush));
}
const vulkan::Kernel& MotionKernels::folds() {
  return get(k_motion_folds, "bsib", sizeof(FoldsPush));
}
const vulkan::Kernel& MotionKernels::blend() {
  return get(k_motion_blend, "bssi", sizeof(BlendPush));
}

const vulkan::Kernel& MotionKernels::confidence() {
  return get(k_motion_confidence, "bssssi", sizeof(ConfidencePush));
}
const vulkan::Kernel& MotionKernels::matching_cost() {
  return get(k_motion_matching_cost, "ssb", sizeof(MatchingPush));
}
const vulkan::Kernel& MotionKernels::smooth_cost() {
  return get(k_motion_smooth_cost, "bb", sizeof(SmoothCostPush));
}
const vulkan::Kernel& MotionKernels::coupled_choice() {
  return get(k_motion_coupled_choice, "bsi", sizeof(CoupledChoicePush));
}
const vulkan::Kernel& MotionKernels::classic_force() {
  return get(k_motion_classic_force, "bsssi", sizeof(ClassicPush));
}

}  // namespace palpate
