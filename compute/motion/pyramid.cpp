#include "compute/motion/pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>

#include "compute/motion/bricks.h"
#include "compute/motion/gauss.h"
#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
const glm::vec4 kOutside(kInfinite, kInfinite, kInfinite, 0.0F);

glm::ivec3 groups_of(glm::ivec3 size, int local_x = 64) {
  return {(size.x + local_x - 1) / local_x, size.y, size.z};
}

/// SD of the window of local normalisation, in cells of the moments.
glm::dvec3 moment_sigma(const MotionPlan& plan, const LevelPlan& level) {
  return plan.options.normalise_window * level.h_mm /
         (level.spacing_mm * glm::dvec3(level.moment_cell));
}

}  // namespace

void record_pack(vulkan::Recorder& recorder, MotionKernels& kernels, const MotionPlan& plan,
                 size_t l, const PackInput& from, const vulkan::Image& texels, const VoxelBox& box,
                 int first_slice) {
  const LevelPlan& level = plan.levels[l];
  // The outermost voxels of the finest level do not count; the classic filter stays as published.
  const bool outermost_count =
      int(l) != plan.options.finest_level || plan.options.method == MotionMethod::kClassic;
  recorder.dispatch(
      kernels.pack(from.mask != nullptr),
      {{from.normalised, kernels.nearest()},
       {from.mask ? *from.mask : from.no_mask, kernels.nearest()},
       texels},
      shaders::PackPush{glm::ivec4(texels.size(), outermost_count ? 0 : level.image_size.z),
                        glm::vec4(level.spacing_mm, 0), glm::ivec4(box.begin, first_slice)},
      groups_of(box.size()));
}

FramePyramid::FramePyramid(const std::shared_ptr<vulkan::Context>& context,
                           const MotionPlan& plan) {
  vulkan::Recorder recorder(context);
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    // A placeholder, which keeps indices equal, for a level finer than the finest one solved, and
    // for a level that is kept on the host.
    const bool used = int(l) >= plan.options.finest_level && (l > 0 || plan.slabs == 1);
    levels_.emplace_back(context, used ? plan.levels[l].image_size : glm::ivec3(1),
                         VK_FORMAT_R16G16B16A16_SFLOAT);
    recorder.prepare(levels_.back());
  }
  if (has_sliding_step(plan)) {
    raw_ = vulkan::Image(context, plan.image.size, VK_FORMAT_R16_SFLOAT);
    recorder.prepare(raw_);
  }
  recorder.run();
  if (plan.slabs == 1) return;
  const uint64_t slice = uint64_t(plan.image.size.x) * uint64_t(plan.image.size.y) * 2;
  for (const Slab& slab : slabs_of(plan)) {
    slabs_.emplace_back(context, slice * uint64_t(slab.depth), vulkan::Buffer::Kind::kHostVisible);
  }
}

PyramidBuilder::Workspace::Workspace(const std::shared_ptr<vulkan::Context>& context,
                                     glm::ivec3 image_size, glm::ivec3 cell, bool holds_raw)
    : size(image_size),
      cells((image_size + cell - 1) / cell),
      normalised(context, size, VK_FORMAT_R16_SFLOAT) {
  vulkan::Recorder recorder(context);
  if (holds_raw) {
    raw = vulkan::Image(context, size, VK_FORMAT_R16_SFLOAT);
    recorder.prepare(raw);
  }
  recorder.prepare(normalised);
  for (vulkan::Image& side : moments) {
    side = vulkan::Image(context, cells, VK_FORMAT_R32G32_SFLOAT);
    recorder.prepare(side);
  }
  recorder.run();
}

PyramidBuilder::PyramidBuilder(std::shared_ptr<vulkan::Context> context,
                               std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan,
                               const Region& region)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      plan_(plan),
      staging_(context_, plan.slabs > 1 ? 4 : plan.image.count() * sizeof(uint16_t),
               vulkan::Buffer::Kind::kHostVisible),
      no_mask_(context_, glm::ivec3(1), VK_FORMAT_R8_UNORM),
      recorder_(context_, uint32_t(16 * plan.levels.size())) {
  recorder_.prepare(no_mask_);
  recorder_.run();
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    const bool on_host = l == 0 && plan_.slabs > 1;
    levels_.emplace_back(context_, on_host ? glm::ivec3(1) : plan_.levels[l].image_size,
                         plan_.levels[l].moment_cell, l > 0 || !has_sliding_step(plan_));
  }
  set_region(region);
}

/// A texel reads the normalised intensity of its neighbours, a normalised intensity reads the
/// moments of the cells around it, and smoothed moments read as far as the taps of the Gaussian
/// along each axis.
void PyramidBuilder::aim(Workspace& work, const LevelPlan& level, const VoxelBox& box) const {
  const auto widened = [](const VoxelBox& inner, glm::ivec3 by, glm::ivec3 size) {
    return VoxelBox{glm::max(inner.begin - by, glm::ivec3(0)), glm::min(inner.end + by, size)};
  };
  work.packed_box = box;
  work.normalised_box = widened(box, glm::ivec3(1), work.size);
  const glm::ivec3 cell = level.moment_cell;
  const glm::dvec3 sigma = moment_sigma(plan_, level);
  glm::ivec3 taps(1);
  for (int a = 0; a < 3; ++a) taps[a] += gauss_push(work.cells, a, sigma[a]).radius.x;
  work.moments_box =
      widened({work.normalised_box.begin / cell, (work.normalised_box.end + cell - 1) / cell}, taps,
              work.cells);
  work.bricks = bricks_over(work.moments_box.begin, work.moments_box.end);
  work.list = upload_bricks(context_, work.bricks);
}

vulkan::Image PyramidBuilder::upload_mask(const uint8_t* values, glm::ivec3 size) {
  vulkan::Image image(context_, size, VK_FORMAT_R8_UNORM);
  const size_t count = size_t(size.x) * size_t(size.y) * size_t(size.z);
  vulkan::Buffer staging(context_, count, vulkan::Buffer::Kind::kHostVisible);
  std::copy(values, values + count, staging.as<uint8_t>().begin());
  vulkan::Recorder recorder(context_);
  recorder.prepare(image);
  recorder.copy(staging, image);
  recorder.run();
  return image;
}

void PyramidBuilder::set_region(const Region& region) {
  assert(region.levels.size() == plan_.levels.size() && "the region must be the plan's");
  reach_mm_ = region.reach_mm;
  masks_.clear();
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    const LevelRegion& level = region.levels[l];
    const bool on_host = l == 0 && plan_.slabs > 1;
    if (!on_host) aim(levels_[l], plan_.levels[l], level.voxels);
    if (!region.masked()) continue;
    masks_.push_back(
        upload_mask(level.mask.data(), on_host ? glm::ivec3(1) : plan_.levels[l].image_size));
  }
}

void PyramidBuilder::record_normalised(vulkan::Recorder& recorder, size_t l, const Workspace& work,
                                       const vulkan::Image& raw, double noise) {
  const LevelPlan& level = plan_.levels[l];
  const glm::ivec4 size(work.size, 0);
  const glm::ivec4 cells(work.cells, 0);
  const glm::ivec4 cell(level.moment_cell, 0);
  const vulkan::Image* moments = &work.moments[0];
  if (plan_.options.normalise) {
    recorder.dispatch(kernels_->moments(), {{raw, kernels_->nearest()}, work.moments[0]},
                      shaders::MomentsPush{size, cells, cell, wide(work.moments_box.begin)},
                      groups_of(work.moments_box.size()));
    if (record_gauss(recorder, *kernels_, work.list, brick_groups(work.bricks),
                     moment_sigma(plan_, level), {&work.moments[0]}, {&work.moments[1]})) {
      moments = &work.moments[1];
    }
  }
  recorder.dispatch(
      kernels_->normalise(),
      {{raw, kernels_->nearest()}, {*moments, kernels_->linear()}, work.normalised},
      shaders::NormalisePush{size,
                             cells,
                             cell,
                             {float(noise * noise), plan_.options.normalise ? 1.0F : 0.0F, 0, 0},
                             wide(work.normalised_box.begin)},
      groups_of(work.normalised_box.size()));
}

/// One slab of the finest level, from the host and back to it, normalised. Its halo is wide enough
/// for that, so the result does not depend on the cuts. Its part of the next level stays in that
/// level's workspace.
void PyramidBuilder::build_slab(const HalfVolume& volume, const Slab& slab, double noise,
                                const vulkan::Buffer& target) {
  const glm::ivec3 whole = plan_.image.size;
  const int halo = normalisation_halo(plan_);
  // A last, short slab contains more slices than it computes. Cells of the moments must lie as in
  // the whole image.
  const int cell = plan_.levels[0].moment_cell.z;
  const int low = std::max(0, std::min(slab.begin, slab.first) - halo) / cell * cell;
  const int high = std::min(whole.z, std::max(slab.end, slab.first + slab.depth) + halo);
  const glm::ivec3 size{whole.x, whole.y, high - low};
  const size_t slice = size_t(whole.x) * size_t(whole.y);
  Workspace work(context_, size, plan_.levels[0].moment_cell, true);
  aim(work, plan_.levels[0], {glm::ivec3(0), size});
  vulkan::Buffer staging(context_, slice * size_t(size.z) * sizeof(uint16_t),
                         vulkan::Buffer::Kind::kHostVisible);
  std::copy_n(volume.bits.get() + slice * size_t(low), slice * size_t(size.z),
              staging.as<uint16_t>().begin());

  vulkan::Recorder recorder(context_, 16);
  recorder.copy(staging, work.raw);
  const LevelPlan& next = plan_.levels[1];
  const int first = slab.begin / next.ratio.z;
  const int count = (slab.end + next.ratio.z - 1) / next.ratio.z - first;
  recorder.dispatch(
      kernels_->downsample(), {{work.raw, kernels_->linear()}, levels_[1].raw},
      shaders::DownsamplePush{glm::ivec4(size, low), glm::ivec4(next.image_size, first),
                              glm::ivec4(next.ratio, count)},
      groups_of({next.image_size.x, next.image_size.y, count}));
  record_normalised(recorder, 0, work, work.raw, noise);
  recorder.copy_slices(work.normalised, slab.first - low, slab.depth, target);
  recorder.run();
}

void PyramidBuilder::build(const HalfVolume& volume, double noise, FramePyramid& target) {
  assert(volume.count == plan_.image.count() && "the frame must have the plan's size");
  const size_t first_whole = plan_.slabs > 1 ? 1 : 0;
  recorder_.restart();
  if (target.reach_mm_ != reach_mm_ && std::isfinite(reach_mm_)) {
    // Texels outside the boxes are marked as not counting.
    for (size_t l = 0; l < plan_.levels.size(); ++l) recorder_.clear(target.level(l), kOutside);
  }
  target.reach_mm_ = reach_mm_;
  target.noise_ = noise;
  const auto raw = [&](size_t l) -> const vulkan::Image& {
    return l == 0 && target.raw_ ? target.raw_ : levels_[l].raw;
  };
  if (plan_.slabs > 1) {
    const std::vector<Slab> slabs = slabs_of(plan_);
    for (size_t s = 0; s < slabs.size(); ++s) build_slab(volume, slabs[s], noise, target.slab(s));
  } else {
    constexpr size_t kPart = 1 << 16;
    const std::span<uint16_t> to = staging_.as<uint16_t>();
    parallel_ranges(int((volume.count + kPart - 1) / kPart), double(kPart),
                    [&](int begin, int end) {
                      const size_t first = size_t(begin) * kPart;
                      std::copy_n(volume.bits.get() + first,
                                  std::min(volume.count, size_t(end) * kPart) - first,
                                  to.begin() + std::ptrdiff_t(first));
                    });
    recorder_.copy(staging_, raw(0));
  }
  for (size_t l = first_whole; l < plan_.levels.size(); ++l) {
    const LevelPlan& level = plan_.levels[l];
    if (l > first_whole) {
      recorder_.dispatch(
          kernels_->downsample(), {{raw(l - 1), kernels_->linear()}, levels_[l].raw},
          shaders::DownsamplePush{glm::ivec4(plan_.levels[l - 1].image_size, 0),
                                  glm::ivec4(level.image_size, 0), glm::ivec4(level.ratio, 0)},
          groups_of(level.image_size));
    }
    const VoxelBox& box = levels_[l].packed_box;
    if (int(l) < plan_.options.finest_level || box.empty()) continue;
    record_normalised(recorder_, l, levels_[l], raw(l), noise);
    record_pack(recorder_, *kernels_, plan_, l,
                {levels_[l].normalised, masks_.empty() ? nullptr : &masks_[l], no_mask_},
                target.level(l), box, 0);
  }
  recorder_.run();
}

}  // namespace palpate
