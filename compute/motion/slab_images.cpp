#include "compute/motion/slab_images.h"

#include <algorithm>
#include <optional>

namespace palpate {

SlabImages::SlabImages(std::shared_ptr<vulkan::Context> context,
                       std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan,
                       const Region& region)
    : kernels_(std::move(kernels)), plan_(plan), slabs_(slabs_of(plan)) {
  const glm::ivec3 size{plan.image.size.x, plan.image.size.y, slabs_.front().depth};
  fixed_ = vulkan::Image(context, size, VK_FORMAT_R16G16B16A16_SFLOAT);
  moving_ = vulkan::Image(context, size, VK_FORMAT_R16G16B16A16_SFLOAT);
  normalised_ = vulkan::Image(context, size, VK_FORMAT_R16_SFLOAT);
  mask_ = vulkan::Image(context, region.masked() ? size : glm::ivec3(1), VK_FORMAT_R8_UNORM);
  vulkan::Recorder recorder(context);
  for (const vulkan::Image* image : {&fixed_, &moving_, &normalised_, &mask_})
    recorder.prepare(*image);
  recorder.run();
  if (!region.masked()) return;
  const std::vector<uint8_t>& mask = region.levels.front().mask;
  const size_t slice = size_t(size.x) * size_t(size.y);
  for (const Slab& slab : slabs_) {
    masks_.emplace_back(context, slice * size_t(slab.depth), vulkan::Buffer::Kind::kHostVisible);
    std::copy_n(mask.begin() + std::ptrdiff_t(slice * size_t(slab.first)),
                slice * size_t(slab.depth), masks_.back().as<uint8_t>().begin());
  }
}

int SlabImages::most_dispatches(const MotionPlan& plan) {
  return plan.slabs > 1 ? plan.slabs * (plan.slabs + 1) : 0;
}

void SlabImages::record_texels(vulkan::Recorder& recorder, const FramePyramid& frame, size_t s,
                               const vulkan::Image& texels) const {
  recorder.copy(frame.slab(s), normalised_);
  if (!masks_.empty()) recorder.copy(masks_[s], mask_);
  record_pack(recorder, *kernels_, plan_, 0,
              {normalised_, masks_.empty() ? nullptr : &mask_, mask_}, texels,
              {glm::ivec3(0), texels.size()}, slabs_[s].first);
}

void SlabImages::record_pairs(vulkan::Recorder& recorder, const FramePyramid& fixed,
                              const FramePyramid& moving, const BrickList& bricks, double reach,
                              const Dispatch& dispatch) const {
  // Slices of the fixed frame in which there is work.
  const int brick_slices = shaders::kBrick * plan_.levels[0].cell.z;
  std::vector<bool> has_work(size_t(plan_.image.size.z / brick_slices) + 1);
  for (const uint32_t brick : bricks) has_work[size_t(unpacked(brick).z)] = true;
  const auto works = [&](const Slab& slab) {
    const auto first = has_work.begin() + slab.begin / brick_slices;
    const auto last = has_work.begin() + (slab.end - 1) / brick_slices;
    return std::find(first, last + 1, true) != last + 1;
  };

  std::optional<size_t> there;  // the slab of the moving frame that is on the device
  for (size_t a = 0; a < slabs_.size(); ++a) {
    if (!works(slabs_[a])) continue;
    record_texels(recorder, fixed, a, fixed_);
    std::vector<size_t> near;
    for (size_t b = 0; b < slabs_.size(); ++b) {
      const int apart =
          std::max(slabs_[a].begin, slabs_[b].begin) - std::min(slabs_[a].end, slabs_[b].end);
      if (apart > reach) continue;
      near.insert(b == there ? near.begin() : near.end(), b);
    }
    for (const size_t b : near) {
      if (b != there) record_texels(recorder, moving, b, moving_);
      there = b;
      dispatch(fixed_, moving_, slabs_[a], slabs_[b]);
    }
  }
}

}  // namespace palpate
