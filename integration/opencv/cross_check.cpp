#include "integration/opencv/cross_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "integration/opencv/flow_slices.h"

namespace palpate::opencv {
namespace {

constexpr int kSmallestSlice = 32;
/// Flow is poor near the border of its image, where its windows are cut; DIS's patches are 8 pixels
/// wide.
constexpr int kBorderPixels = 8;
constexpr FlowMethod kMethods[] = {FlowMethod::kDis, FlowMethod::kFarneback};

struct FramePair {
  const Volume& fixed;
  const Volume& moving;
  const Field& u;
  const Mask* mask;
  GreyRange fixed_window, moving_window;
  double fixed_noise, moving_noise;
};

/// Differences of one method and orientation, as slices come in.
struct Collected {
  FlowComparison comparison;
  std::vector<glm::vec3> difference_mm;
  std::vector<float> motion_mm;
};

/// One slice of both frames, ready to be compared.
struct SlicePair {
  const SliceStack& stack;
  int n;
  cv::Mat fixed, moving, structure, moving_structure;
};

bool in_mask(const FramePair& frames, glm::dvec3 index) {
  if (!frames.mask) return true;
  const glm::ivec3 nearest(glm::round(index));
  return frames.mask->values[frames.mask->grid.offset(nearest.x, nearest.y, nearest.z)] != 0;
}

/// u at a pixel, split along the slice's own axes, mm.
glm::dvec3 split(const SliceStack& stack, glm::dvec3 u_mm) {
  return {glm::dot(u_mm, stack.right()), glm::dot(u_mm, stack.down()),
          glm::dot(u_mm, stack.through())};
}

bool well_inside(cv::Size size, double x, double y) {
  return x >= kBorderPixels && y >= kBorderPixels && x <= size.width - 1 - kBorderPixels &&
         y <= size.height - 1 - kBorderPixels;
}

void compare_slice(const FramePair& frames, const SlicePair& pair, const CrossCheckOptions& options,
                   Collected& out) {
  const cv::Mat forward = flow(out.comparison.method, pair.fixed, pair.moving);
  const cv::Mat backward = flow(out.comparison.method, pair.moving, pair.fixed);
  const cv::Mat unsure = return_error(forward, backward);
  const SliceStack& stack = pair.stack;
  const Grid& grid = frames.fixed.grid;
  const double voxel_mm = grid.finest_mm();
  const double pixel_mm = stack.pixel_mm();
  const double per_noise = options.structure_noises * kGradientOfUnitNoise;
  ++out.comparison.slices;
  for (int y = 0; y < forward.rows; ++y) {
    for (int x = 0; x < forward.cols; ++x) {
      const glm::dvec3 index = stack.index(x, y, pair.n);
      if (!in_mask(frames, index)) continue;
      ++out.comparison.pixels;
      if (!well_inside(stack.size(), x, y)) continue;
      if (!(double(pair.structure.at<float>(y, x)) > per_noise * frames.fixed_noise)) continue;
      if (double(unsure.at<float>(y, x)) * pixel_mm > options.return_voxels * voxel_mm) continue;
      const glm::dvec3 u_mm = split(stack, sample_at_lps(frames.u, grid.lps_from_index(index)));
      if (std::abs(u_mm.z) > options.through_voxels * voxel_mm) continue;
      if (!well_inside(stack.size(), x + u_mm.x / pixel_mm, y + u_mm.y / pixel_mm)) continue;
      const cv::Vec2f v = forward.at<cv::Vec2f>(y, x);
      // Where the flow leads to nothing (an empty frame, its noise) it is a guess.
      const cv::Point there(cvRound(float(x) + v[0]), cvRound(float(y) + v[1]));
      if (!cv::Rect({0, 0}, stack.size()).contains(there)) continue;
      const double found = double(pair.moving_structure.at<float>(there));
      if (!(found > per_noise * frames.moving_noise)) continue;
      const glm::dvec2 flow_mm = pixel_mm * glm::dvec2(v[0], v[1]);
      const glm::dvec2 off_mm = flow_mm - glm::dvec2(u_mm);
      out.difference_mm.emplace_back(off_mm.x * stack.right() + off_mm.y * stack.down());
      out.motion_mm.push_back(float(glm::length(glm::dvec2(u_mm))));
    }
  }
}

FlowComparison summed_up(Collected& collected, const Grid& grid) {
  FlowComparison& comparison = collected.comparison;
  const double scale = 1.0 / grid.finest_mm();
  comparison.compared = collected.difference_mm.size();
  comparison.difference = distances_of(collected.difference_mm, grid);
  comparison.motion_voxels = spread_of(collected.motion_mm).median * scale;
  return comparison;
}

/// The slices of one orientation: not the outermost ones, where half of a window is missing.
std::vector<int> slice_numbers(int size, int wanted) {
  const int count = std::min(wanted, size);
  std::vector<int> numbers;
  for (int n = 0; n < count; ++n) numbers.push_back(int((n + 0.5) * size / count));
  return numbers;
}

void check_orientation(const FramePair& frames, int normal_axis, const CrossCheckOptions& options,
                       std::vector<FlowComparison>& out) {
  const SliceStack stack(frames.fixed.grid, normal_axis);
  if (std::min(stack.size().width, stack.size().height) < kSmallestSlice) return;
  Collected collected[2];
  for (int m = 0; m < 2; ++m) {
    collected[m].comparison.normal_axis = normal_axis;
    collected[m].comparison.method = kMethods[m];
  }
  for (const int n : slice_numbers(frames.fixed.grid.size[normal_axis], options.slices)) {
    const cv::Mat fixed = stack.slice(frames.fixed, n);
    const cv::Mat moving = stack.slice(frames.moving, n);
    const SlicePair pair{stack,
                         n,
                         windowed(fixed, frames.fixed_window),
                         windowed(moving, frames.moving_window),
                         weaker_gradient(fixed),
                         weaker_gradient(moving)};
    for (Collected& method : collected) compare_slice(frames, pair, options, method);
  }
  for (Collected& method : collected) out.push_back(summed_up(method, frames.fixed.grid));
}

/// The better method of one orientation, or null if neither has enough to compare.
const FlowComparison* better(const std::vector<FlowComparison>& comparisons, int normal_axis,
                             const CrossCheckOptions& options) {
  const FlowComparison* best = nullptr;
  for (const FlowComparison& c : comparisons) {
    if (c.normal_axis != normal_axis || c.compared < options.least_pixels) continue;
    if (!best || c.difference.mm.median < best->difference.mm.median) best = &c;
  }
  return best;
}

void conclude(const CrossCheckOptions& options, CrossCheck& check) {
  double worst = -1.0;
  double worst_p95 = 0.0;
  size_t pixels = 0;
  size_t compared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    size_t most = 0;
    size_t all = 0;
    for (const FlowComparison& c : check.comparisons) {
      if (c.normal_axis != axis) continue;
      most = std::max(most, c.compared);
      all = c.pixels;
    }
    pixels += all;
    compared += most;
    const FlowComparison* best = better(check.comparisons, axis, options);
    if (!best) continue;
    worst = std::max(worst, best->difference.voxels.median);
    worst_p95 = std::max(worst_p95, best->difference.voxels.p95);
  }
  check.share_compared = pixels ? double(compared) / double(pixels) : 0.0;
  const double percent = 100.0 * check.share_compared;
  char text[400];
  if (worst < 0.0) {
    check.agreement = Agreement::kCanNotTell;
    std::snprintf(text, sizeof(text),
                  "Optical flow can not tell: only %.1f %% of the slices show enough structure and "
                  "little enough motion through them.",
                  percent);
  } else {
    const bool agree = worst <= options.agree_voxels && worst_p95 <= options.agree_p95_voxels;
    check.agreement = agree ? Agreement::kAgree : Agreement::kDisagree;
    std::snprintf(
        text, sizeof(text),
        "Optical flow %s: on the %.1f %% of the slices that can be compared the difference in the "
        "worst orientation is %.2f voxels in the median (at most %.2f) and %.2f at the 95th "
        "percentile (at most %.2f).",
        agree ? "agrees" : "disagrees", percent, worst, options.agree_voxels, worst_p95,
        options.agree_p95_voxels);
  }
  check.summary = text;
}

}  // namespace

const char* name(FlowMethod method) {
  return method == FlowMethod::kDis ? "DIS" : "Farneback";
}

Result<CrossCheck> cross_check(const Volume& fixed, const Volume& moving, const Field& u,
                               const CrossCheckOptions& options, const Mask* mask) {
  if (mask && !same_geometry(mask->grid, fixed.grid)) {
    return Error{ErrorKind::kBadInput,
                 "The mask and the fixed frame lie on different grids; use a mask of the fixed "
                 "frame's grid."};
  }
  const FramePair frames{
      fixed,           moving,          u, mask, window_of(fixed), window_of(moving),
      noise_sd(fixed), noise_sd(moving)};
  CrossCheck check;
  for (int axis = 0; axis < 3; ++axis) check_orientation(frames, axis, options, check.comparisons);
  conclude(options, check);
  return check;
}

}  // namespace palpate::opencv
