#include "integration/opencv/slice_flow.h"

#include <algorithm>
#include <chrono>
#include <opencv2/imgproc.hpp>

#include "integration/opencv/flow_slices.h"

namespace palpate::opencv {
namespace {

constexpr int kLeastPixels = 32;

/// Adds half of the flow of one slice at the volume's samples, bilinear between pixels: two
/// orientations see each component.
void add_half(const cv::Mat& pixels, const SliceStack& stack, int normal, int n, Field& field) {
  const Grid& grid = field.grid;
  const int a = normal == 0 ? 1 : 0, b = normal == 2 ? 1 : 2;
  cv::Mat x(grid.size[b], grid.size[a], CV_32F), y(x.size(), CV_32F), there;
  for (int row = 0; row < x.rows; ++row) {
    for (int column = 0; column < x.cols; ++column) {
      x.at<float>(row, column) = float(column * grid.spacing_mm[a] / stack.pixel_mm());
      y.at<float>(row, column) = float(row * grid.spacing_mm[b] / stack.pixel_mm());
    }
  }
  cv::remap(pixels, there, x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  for (int row = 0; row < x.rows; ++row) {
    for (int column = 0; column < x.cols; ++column) {
      glm::ivec3 at(n);
      at[a] = column;
      at[b] = row;
      const cv::Vec2f flow = there.at<cv::Vec2f>(row, column);
      field.u_mm[grid.offset(at.x, at.y, at.z)] +=
          glm::vec3(0.5 * stack.pixel_mm() *
                    (double(flow[0]) * stack.right() + double(flow[1]) * stack.down()));
    }
  }
}

}  // namespace

Result<SliceFlow> slice_flow(FlowMethod method, const Volume& fixed, const Volume& moving,
                             const std::stop_token& stop) {
  if (!same_geometry(fixed.grid, moving.grid))
    return Error{ErrorKind::kBadInput, "Optical flow needs both frames on one grid."};
  const GreyRange from = window_of(fixed), to = window_of(moving);
  SliceFlow result{still_field(fixed.grid), 0.0};
  for (int normal = 0; normal < 3; ++normal) {
    const SliceStack stack(fixed.grid, normal);
    if (std::min(stack.size().width, stack.size().height) < kLeastPixels)
      return Error{ErrorKind::kBadInput, "Slices under 32 pixels are too small for optical flow."};
    for (int n = 0; n < fixed.grid.size[normal]; ++n) {
      if (stop.stop_requested()) return Error{ErrorKind::kCancelled, "Stopped."};
      const cv::Mat first = windowed(stack.slice(fixed, n), from),
                    second = windowed(stack.slice(moving, n), to);
      const auto begin = std::chrono::steady_clock::now();
      const cv::Mat pixels = flow(method, first, second);
      const auto end = std::chrono::steady_clock::now();
      result.seconds += std::chrono::duration<double>(end - begin).count();
      add_half(pixels, stack, normal, n, result.field);
    }
  }
  return result;
}

}  // namespace palpate::opencv
