#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "compute/volume/volume.h"
#include "integration/opencv/cross_check.h"

/// Slices of volumes as OpenCV images, and the flow between two of them. Private to this folder.
namespace palpate::opencv {

/// Slices normal to one index axis, with square pixels of the finer of their two edges.
class SliceStack {
 public:
  SliceStack(const Grid& grid, int normal_axis);

  cv::Size size() const { return size_; }
  double pixel_mm() const { return pixel_mm_; }
  /// The index of a pixel of slice n in the grid of the volume.
  glm::dvec3 index(int x, int y, int n) const;
  /// Unit vectors of the pixel axes and the normal, LPS.
  glm::dvec3 right() const { return grid_.direction[a_]; }
  glm::dvec3 down() const { return grid_.direction[b_]; }
  glm::dvec3 through() const { return grid_.direction[normal_]; }
  /// The values of a volume (on any grid) in slice n of this one, CV_32F.
  cv::Mat slice(const Volume& volume, int n) const;

 private:
  Grid grid_;
  int normal_, a_, b_;
  double pixel_mm_;
  cv::Size size_;
};

/// Grey values 0 to 255 between the 1st and 99th percentile of a whole frame.
struct GreyRange {
  double low = 0.0;
  double high = 1.0;
};
GreyRange window_of(const Volume& volume);
cv::Mat windowed(const cv::Mat& slice, GreyRange window);

/// Flow in pixels, CV_32FC2: from(x) = to(x + flow(x)). Both images CV_8U of one size of at least
/// 32 x 32.
cv::Mat flow(FlowMethod method, const cv::Mat& from, const cv::Mat& to);

/// |forward(x) + backward(x + forward(x))| in pixels, CV_32F.
cv::Mat return_error(const cv::Mat& forward, const cv::Mat& backward);

/// The square root of the smaller eigenvalue of the gradient's second moments over 7 x 7 pixels, in
/// grey values (of the unwindowed slice) per pixel; CV_32F. It is large where both components of a
/// motion can be seen.
cv::Mat weaker_gradient(const cv::Mat& slice);
/// What weaker_gradient gives for white noise of SD 1.
constexpr double kGradientOfUnitNoise = 0.433;

}  // namespace palpate::opencv
