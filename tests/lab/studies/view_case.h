#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "compute/volume/phantom.h"
#include "module/scene/look.h"
#include "module/view/eye.h"

/// The scene for palpate and its peer: the same data, looks and eyes for both.
namespace palpate::studies {

inline constexpr PictureSize kViewSize{512, 512};
inline constexpr double kEyesApartM = 0.06;
/// Samples per voxel to try, from the coarsest on, until the quality is sufficient.
inline constexpr std::array kRates{0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6};
inline constexpr double kEnoughDb = 40.0;

/// The heart phantom at 256^3, half a millimetre per voxel.
inline Volume view_data(int size = 256) {
  return shell_phantom(heart_grid(size), 4, 1, 0.0).frames[1];
}

/// Sparse: only the edge of the wall, a shell two or three voxels thick. Dense: all values have
/// some opacity, so there is nothing to skip, and light passes nearly everywhere.
inline Look view_look(bool dense) {
  Look look{dense ? "dense" : "sparse", {}, {0.3, 0.7, 0.2}, 100.0};
  if (dense) {
    look.points = {{0.0, {0.35, 0.45, 0.60}, 0.002},
                   {150.0, {0.45, 0.55, 0.70}, 0.004},
                   {350.0, {0.80, 0.30, 0.25}, 0.010},
                   {650.0, {0.90, 0.55, 0.40}, 0.030},
                   {1100.0, {1.0, 0.9, 0.8}, 0.050}};
  } else {
    look.points = {{500.0, {0.75, 0.25, 0.2}, 0.0},
                   {600.0, {0.85, 0.40, 0.3}, 0.7},
                   {650.0, {0.85, 0.40, 0.3}, 0.7},
                   {750.0, {0.90, 0.55, 0.4}, 0.0}};
  }
  return look;
}

/// Two eyes outside, directed at the middle; the cube of 128 mm fills the picture.
inline std::array<Eye, 2> view_eyes(glm::dvec3 from = {0.11, 0.09, 0.21}) {
  const Eye middle = eye_at(from, {0.0, 0.0, 0.0}, 0.62, kViewSize);
  std::array<Eye, 2> eyes;
  split_eyes(middle, kEyesApartM, eyes[0], eyes[1]);
  return eyes;
}

inline std::vector<Eye> both_view_eyes(glm::dvec3 from = {0.11, 0.09, 0.21}) {
  const auto eyes = view_eyes(from);
  return {eyes.begin(), eyes.end()};
}

/// Peak signal to noise ratio of two sets of 8-bit RGB values, dB, over all pixels.
inline double psnr_db(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double d = double(a[i]) - double(b[i]);
    sum += d * d;
  }
  return sum > 0.0 ? 10.0 * std::log10(255.0 * 255.0 * double(a.size()) / sum) : 99.0;
}

}  // namespace palpate::studies
