#include "integration/opencv/flow_slices.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace palpate::opencv {
namespace {

constexpr size_t kWindowSamples = 200000;

int pixels(int samples, double spacing_mm, double pixel_mm) {
  // The small constant keeps the last sample when the division comes out a rounding error short.
  return int(std::floor((samples - 1) * spacing_mm / pixel_mm + 1e-9)) + 1;
}

}  // namespace

SliceStack::SliceStack(const Grid& grid, int normal_axis)
    : grid_(grid),
      normal_(normal_axis),
      a_(normal_axis == 0 ? 1 : 0),
      b_(normal_axis == 2 ? 1 : 2) {
  const double da = grid.spacing_mm[a_];
  const double db = grid.spacing_mm[b_];
  pixel_mm_ = std::min(da, db);
  size_ = {pixels(grid.size[a_], da, pixel_mm_), pixels(grid.size[b_], db, pixel_mm_)};
}

glm::dvec3 SliceStack::index(int x, int y, int n) const {
  glm::dvec3 index(0.0);
  index[a_] = x * pixel_mm_ / grid_.spacing_mm[a_];
  index[b_] = y * pixel_mm_ / grid_.spacing_mm[b_];
  index[normal_] = n;
  return index;
}

cv::Mat SliceStack::slice(const Volume& volume, int n) const {
  cv::Mat image(size_, CV_32F);
  for (int y = 0; y < size_.height; ++y) {
    float* row = image.ptr<float>(y);
    for (int x = 0; x < size_.width; ++x) {
      const glm::dvec3 lps_mm = grid_.lps_from_index(index(x, y, n));
      row[x] = float(sample(volume, volume.grid.index_from_lps(lps_mm)));
    }
  }
  return image;
}

GreyRange window_of(const Volume& volume) {
  std::vector<float> values;
  // An odd stride, so that it does not fall into step with rows of even length.
  const size_t every = (volume.values.size() / kWindowSamples) | 1U;
  for (size_t n = 0; n < volume.values.size(); n += every) {
    if (std::isfinite(volume.values[n])) values.push_back(volume.values[n]);
  }
  if (values.empty()) return {};
  const auto percentile = [&](double share) {
    const auto place = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return double(*place);
  };
  const double low = percentile(0.01);
  return {low, std::max(percentile(0.99), low + 1e-6 * (1.0 + std::abs(low)))};
}

cv::Mat windowed(const cv::Mat& slice, GreyRange window) {
  const double scale = 255.0 / (window.high - window.low);
  cv::Mat grey;
  slice.convertTo(grey, CV_8U, scale, -window.low * scale);
  return grey;
}

cv::Mat flow(FlowMethod method, const cv::Mat& from, const cv::Mat& to) {
  cv::Mat result;
  if (method == FlowMethod::kDis) {
    const auto dis = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
    // The preset stops at half resolution; slices are small, and half a pixel matters here.
    dis->setFinestScale(0);
    dis->calc(from, to, result);
  } else {
    // Five levels of 0.5, windows of 15 pixels, neighbourhoods of 7: OpenCV's own advice for smooth
    // flow.
    cv::calcOpticalFlowFarneback(from, to, result, 0.5, 5, 15, 5, 7, 1.5,
                                 cv::OPTFLOW_FARNEBACK_GAUSSIAN);
  }
  return result;
}

cv::Mat return_error(const cv::Mat& forward, const cv::Mat& backward) {
  cv::Mat where(forward.size(), CV_32FC2);
  for (int y = 0; y < forward.rows; ++y) {
    for (int x = 0; x < forward.cols; ++x) {
      where.at<cv::Vec2f>(y, x) = forward.at<cv::Vec2f>(y, x) + cv::Vec2f(float(x), float(y));
    }
  }
  cv::Mat returned;
  cv::remap(backward, returned, where, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat error(forward.size(), CV_32F);
  for (int y = 0; y < forward.rows; ++y) {
    for (int x = 0; x < forward.cols; ++x) {
      error.at<float>(y, x) =
          float(cv::norm(forward.at<cv::Vec2f>(y, x) + returned.at<cv::Vec2f>(y, x)));
    }
  }
  return error;
}

cv::Mat weaker_gradient(const cv::Mat& slice) {
  constexpr int kWindow = 7;
  cv::Mat gx, gy;
  // A Sobel kernel over 8 is a derivative per pixel; white noise of SD 1 gives sqrt(12) / 8 =
  // 0.433.
  cv::Sobel(slice, gx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(slice, gy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::Mat xx, yy, xy;
  cv::boxFilter(gx.mul(gx), xx, CV_32F, {kWindow, kWindow});
  cv::boxFilter(gy.mul(gy), yy, CV_32F, {kWindow, kWindow});
  cv::boxFilter(gx.mul(gy), xy, CV_32F, {kWindow, kWindow});
  cv::Mat result(slice.size(), CV_32F);
  for (int y = 0; y < slice.rows; ++y) {
    for (int x = 0; x < slice.cols; ++x) {
      const double a = double(xx.at<float>(y, x));
      const double c = double(yy.at<float>(y, x));
      const double b = double(xy.at<float>(y, x));
      const double smaller = 0.5 * (a + c - std::sqrt((a - c) * (a - c) + 4.0 * b * b));
      result.at<float>(y, x) = float(std::sqrt(std::max(0.0, smaller)));
    }
  }
  return result;
}

}  // namespace palpate::opencv
