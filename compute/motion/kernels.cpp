#include "compute/motion/kernels.h"

#include "shaders/interface/motion.h"
#include "spirv/motion/blend.h"
#include "spirv/motion/blend_along.h"
#include "spirv/motion/blend_along_loads.h"
#include "spirv/motion/choose.h"
#include "spirv/motion/classic_force.h"
#include "spirv/motion/classic_force_loads.h"
#include "spirv/motion/clear.h"
#include "spirv/motion/confidence.h"
#include "spirv/motion/coupled_choice.h"
#include "spirv/motion/downsample.h"
#include "spirv/motion/folds.h"
#include "spirv/motion/folds_loads.h"
#include "spirv/motion/gauss.h"
#include "spirv/motion/gauss_loads.h"
#include "spirv/motion/leave_out.h"
#include "spirv/motion/left_out_error.h"
#include "spirv/motion/matching_cost.h"
#include "spirv/motion/matching_cost_loads.h"
#include "spirv/motion/measure.h"
#include "spirv/motion/measure_loads.h"
#include "spirv/motion/median.h"
#include "spirv/motion/median_loads.h"
#include "spirv/motion/moments.h"
#include "spirv/motion/moments_loads.h"
#include "spirv/motion/normal_equations.h"
#include "spirv/motion/normal_equations_loads.h"
#include "spirv/motion/normalise.h"
#include "spirv/motion/normalise_loads.h"
#include "spirv/motion/pack.h"
#include "spirv/motion/pack_loads.h"
#include "spirv/motion/refit.h"
#include "spirv/motion/shared_noise.h"
#include "spirv/motion/sliding_choose.h"
#include "spirv/motion/sliding_choose_loads.h"
#include "spirv/motion/sliding_cost.h"
#include "spirv/motion/sliding_cost_loads.h"
#include "spirv/motion/sliding_find.h"
#include "spirv/motion/sliding_find_loads.h"
#include "spirv/motion/sliding_moments.h"
#include "spirv/motion/sliding_moments_loads.h"
#include "spirv/motion/sliding_take.h"
#include "spirv/motion/sliding_take_loads.h"
#include "spirv/motion/sliding_work.h"
#include "spirv/motion/sliding_work_loads.h"
#include "spirv/motion/smooth_cost.h"
#include "spirv/motion/tv_dual.h"
#include "spirv/motion/tv_dual_loads.h"
#include "spirv/motion/tv_primal.h"
#include "spirv/motion/tv_primal_loads.h"
#include "spirv/motion/tv_second_dual.h"
#include "spirv/motion/tv_second_dual_loads.h"
#include "spirv/motion/tv_second_primal.h"
#include "spirv/motion/tv_second_primal_loads.h"
#include "spirv/motion/update.h"
#include "spirv/motion/update_loads.h"
#include "spirv/motion/update_two.h"
#include "spirv/motion/update_two_loads.h"
#include "spirv/motion/upsample.h"
#include "spirv/motion/upsample_cubic.h"
#include "spirv/motion/upsample_cubic_loads.h"
#include "spirv/motion/window_share.h"

namespace palpate {

MotionKernels::MotionKernels(std::shared_ptr<vulkan::Context> context, Texels texels)
    : context_(std::move(context)),
      loads_(texels == Texels::kAsSuits && context_->is_cpu() &&
             context_->loads_extended_formats()),
      nearest_(context_, VK_FILTER_NEAREST),
      linear_(context_, VK_FILTER_LINEAR) {}

const vulkan::Kernel& MotionKernels::get(const Code& code, uint32_t push_bytes,
                                         std::vector<uint32_t> specialisation) {
  const std::span<const uint32_t> spirv = loads_ && !code.loads.empty() ? code.loads : code.fetches;
  const std::lock_guard lock(mutex_);
  vulkan::Kernel& kernel = kernels_[{spirv.data(), specialisation}];
  if (!kernel.pipeline()) {
    vulkan::KernelOptions options;
    options.spirv = spirv;
    options.push_bytes = push_bytes;
    options.specialisation = std::move(specialisation);
    kernel = vulkan::Kernel(context_, options);
  }
  return kernel;
}

using namespace shaders;

void MotionKernels::record_clear(vulkan::Recorder& recorder, const vulkan::Image& image) {
  const glm::ivec3 size = image.size();
  recorder.dispatch(get(k_motion_clear, sizeof(ClearPush)), {image}, ClearPush{{size, 0}},
                    {(size.x + 63) / 64, size.y, size.z});
}

const vulkan::Kernel& MotionKernels::downsample() {
  return get(k_motion_downsample, sizeof(DownsamplePush));
}
const vulkan::Kernel& MotionKernels::moments() {
  return get({k_motion_moments, k_motion_moments_loads}, sizeof(MomentsPush));
}
const vulkan::Kernel& MotionKernels::gauss(int radius, VkFormat format) {
  Code code{k_motion_gauss, k_motion_gauss_loads};
  if (format != VK_FORMAT_R16G16B16A16_SFLOAT) code.loads = {};
  return get(code, sizeof(GaussPush), {uint32_t(radius)});
}
const vulkan::Kernel& MotionKernels::normalise() {
  return get({k_motion_normalise, k_motion_normalise_loads}, sizeof(NormalisePush));
}
const vulkan::Kernel& MotionKernels::pack(bool masked) {
  return get({k_motion_pack, k_motion_pack_loads}, sizeof(PackPush), {masked ? 1U : 0U});
}
const vulkan::Kernel& MotionKernels::normal_equations(glm::ivec3 cell) {
  return get({k_motion_normal_equations, k_motion_normal_equations_loads},
             sizeof(NormalEquationsPush), {uint32_t(cell.x), uint32_t(cell.y), uint32_t(cell.z)});
}
const vulkan::Kernel& MotionKernels::update() {
  return get({k_motion_update, k_motion_update_loads}, sizeof(UpdatePush));
}
const vulkan::Kernel& MotionKernels::update_two() {
  return get({k_motion_update_two, k_motion_update_two_loads}, sizeof(UpdateTwoPush));
}
const vulkan::Kernel& MotionKernels::tv_primal(bool last) {
  return get({k_motion_tv_primal, k_motion_tv_primal_loads}, sizeof(TotalVariationPush),
             {last ? 1U : 0U});
}
const vulkan::Kernel& MotionKernels::tv_dual() {
  return get({k_motion_tv_dual, k_motion_tv_dual_loads}, sizeof(TotalVariationPush));
}
const vulkan::Kernel& MotionKernels::tv_second_primal() {
  return get({k_motion_tv_second_primal, k_motion_tv_second_primal_loads},
             sizeof(TotalVariationPush));
}
const vulkan::Kernel& MotionKernels::tv_second_dual() {
  return get({k_motion_tv_second_dual, k_motion_tv_second_dual_loads}, sizeof(TotalVariationPush));
}
const vulkan::Kernel& MotionKernels::upsample() {
  return get(k_motion_upsample, sizeof(UpsamplePush));
}
const vulkan::Kernel& MotionKernels::upsample_cubic() {
  return get({k_motion_upsample_cubic, k_motion_upsample_cubic_loads}, sizeof(UpsamplePush));
}
const vulkan::Kernel& MotionKernels::measure() {
  return get({k_motion_measure, k_motion_measure_loads}, sizeof(MeasurePush));
}
const vulkan::Kernel& MotionKernels::folds() {
  return get({k_motion_folds, k_motion_folds_loads}, sizeof(FoldsPush));
}
const vulkan::Kernel& MotionKernels::blend() {
  return get(k_motion_blend, sizeof(BlendPush));
}

const vulkan::Kernel& MotionKernels::confidence() {
  return get(k_motion_confidence, sizeof(ConfidencePush));
}
const vulkan::Kernel& MotionKernels::matching_cost() {
  return get({k_motion_matching_cost, k_motion_matching_cost_loads}, sizeof(MatchingPush));
}
const vulkan::Kernel& MotionKernels::smooth_cost() {
  return get(k_motion_smooth_cost, sizeof(SmoothCostPush));
}
const vulkan::Kernel& MotionKernels::coupled_choice() {
  return get(k_motion_coupled_choice, sizeof(CoupledChoicePush));
}
const vulkan::Kernel& MotionKernels::choose() {
  return get(k_motion_choose, sizeof(ChoosePush));
}
const vulkan::Kernel& MotionKernels::leave_out() {
  return get(k_motion_leave_out, sizeof(LeaveOutPush));
}
const vulkan::Kernel& MotionKernels::shared_noise() {
  return get(k_motion_shared_noise, sizeof(SharedNoisePush));
}
const vulkan::Kernel& MotionKernels::refit() {
  return get(k_motion_refit, sizeof(UpdatePush));
}
const vulkan::Kernel& MotionKernels::left_out_error() {
  return get(k_motion_left_out_error, sizeof(LeftOutErrorPush));
}
const vulkan::Kernel& MotionKernels::window_share() {
  return get(k_motion_window_share, sizeof(WindowSharePush));
}
const vulkan::Kernel& MotionKernels::sliding_moments() {
  return get({k_motion_sliding_moments, k_motion_sliding_moments_loads},
             sizeof(SlidingMomentsPush));
}
const vulkan::Kernel& MotionKernels::sliding_cost(bool own, bool alone) {
  return get({k_motion_sliding_cost, k_motion_sliding_cost_loads}, sizeof(SlidingCostPush),
             {own ? 1U : 0U, alone ? 1U : 0U});
}
const vulkan::Kernel& MotionKernels::sliding_find() {
  return get({k_motion_sliding_find, k_motion_sliding_find_loads}, sizeof(SlidingFindPush));
}
const vulkan::Kernel& MotionKernels::sliding_work() {
  return get({k_motion_sliding_work, k_motion_sliding_work_loads}, sizeof(SlidingWorkPush));
}
const vulkan::Kernel& MotionKernels::sliding_choose() {
  return get({k_motion_sliding_choose, k_motion_sliding_choose_loads}, sizeof(SlidingChoosePush));
}
const vulkan::Kernel& MotionKernels::sliding_take() {
  return get({k_motion_sliding_take, k_motion_sliding_take_loads}, sizeof(SlidingTakePush));
}
const vulkan::Kernel& MotionKernels::blend_along() {
  return get({k_motion_blend_along, k_motion_blend_along_loads}, sizeof(BlendAlongPush));
}
const vulkan::Kernel& MotionKernels::median() {
  return get({k_motion_median, k_motion_median_loads}, sizeof(MedianPush));
}
const vulkan::Kernel& MotionKernels::classic_force() {
  return get({k_motion_classic_force, k_motion_classic_force_loads}, sizeof(ClassicPush));
}

}  // namespace palpate
