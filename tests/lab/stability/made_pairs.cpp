#include "tests/lab/stability/made_pairs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compute/volume/phantom.h"
#include "compute/volume/phantom_texture.h"

namespace palpate::stability {
namespace {

/// Intensities about 500, most between 200 and 800.
double tissue_of(glm::dvec3 lps_mm, double fine_mm, double coarse_mm, uint32_t seed) {
  return 500.0 + 300.0 * texture::tissue(seed, lps_mm, fine_mm, coarse_mm);
}

/// Structures of one size alone.
double grain(glm::dvec3 lps_mm, double size_mm, uint32_t seed) {
  return 500.0 + 300.0 * texture::smooth_noise(texture::mixed(seed), lps_mm / size_mm);
}

/// A rotation about the middle that decreases towards the border: up to `most` mm, one to one for
/// all values used here.
glm::dvec3 swirl(int size, glm::dvec3 x, double most) {
  const glm::dvec3 r = (x - 0.5 * (size - 1)) / (0.5 * size);
  const double t = glm::dot(r, r);
  if (t >= 1.0) return glm::dvec3(0.0);
  const double fall = (1.0 - t) * (1.0 - t);
  // |r| (1 - r^2)^2 is at most 0.286.
  return most / 0.286 * fall * glm::cross(glm::normalize(glm::dvec3(0.3, 0.5, 1.0)), r);
}

}  // namespace

MotionPair shifted_pair(int size, double displacement, double structure, uint32_t seed) {
  const glm::dvec3 shift = displacement * glm::normalize(glm::dvec3(0.8, 0.5, 0.33));
  return pair_of(
      cube(size), [=](glm::dvec3 x) { return grain(x, structure, seed); },
      [=](glm::dvec3) { return shift; });
}

MotionPair lit_pair(int size, double more_gain, double bias, uint32_t seed) {
  MotionPair pair = noisy_pair(size, 0.02, 3.0, seed);
  const Grid& grid = pair.moving.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        float& value = pair.moving.values[grid.offset(i, j, k)];
        value = float((1.0 + more_gain) * value + bias * kRange * i / (size - 1.0));
      }
  return pair;
}

MotionPair noisy_pair(int size, double noise, double displacement, uint32_t seed) {
  MotionPair pair = pair_of(
      cube(size), [=](glm::dvec3 x) { return tissue_of(x, 6.0, 13.0, seed); },
      [=](glm::dvec3 x) { return swirl(size, x, displacement); });
  add_noise(pair, noise * deviation(pair.moving), seed);
  return pair;
}

MotionPair flat_pair(int size, double radius, double displacement, uint32_t seed) {
  const glm::dvec3 middle(0.5 * (size - 1));
  const double scored = std::max(radius, 4.0);
  const auto body = [=](glm::dvec3 x) {
    const double edge = texture::soft_step(glm::length(x - middle) - radius, 1.5);
    return 500.0 + edge * (tissue_of(x, 6.0, 13.0, seed) - 500.0);
  };
  // At its rim the ball is nearly still: the outside gives no information on the inside.
  const auto u = [=](glm::dvec3 x) {
    const double t = glm::length(x - middle) / std::max(radius, 12.0);
    const double inner = t < 1.0 ? (1.0 - t * t) * (1.0 - t * t) : 0.0;
    return glm::dvec3(displacement * inner, 0.0, 0.0);
  };
  MotionPair pair = pair_of(cube(size), body, u);
  add_noise(pair, 0.02 * deviation(pair.moving), seed);
  const Grid& grid = pair.fixed.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        pair.mask.values[grid.offset(i, j, k)] &=
            uint8_t(glm::length(glm::dvec3(i, j, k) - middle) < scored);
  return pair;
}

MotionPair folding_pair(int size, double gradient, double wavelength, uint32_t seed) {
  const double k = 2.0 * std::numbers::pi / wavelength;
  MotionPair pair = pair_of(
      cube(size), [=](glm::dvec3 x) { return tissue_of(x, 4.0, 9.0, seed); },
      [=](glm::dvec3 x) { return glm::dvec3(gradient / k * std::sin(k * x.x), 0.0, 0.0); });
  add_noise(pair, 0.02 * deviation(pair.moving), seed);
  return pair;
}

MotionPair sliding_pair(int size, double shift, uint32_t seed) {
  const double middle = 0.5 * (size - 1);
  MotionPair pair = pair_of(
      cube(size),
      [=](glm::dvec3 x) { return tissue_of(x, 5.0, 11.0, x.x > middle ? seed : seed + 77); },
      [=](glm::dvec3 x) {
        return glm::dvec3(0.0, x.x > middle ? 0.5 * shift : -0.5 * shift, 0.0);
      });
  add_noise(pair, 0.02 * deviation(pair.moving), seed);
  return pair;
}

MotionPair scored_at(MotionPair sliding, double distance) {
  const Grid& grid = sliding.fixed.grid;
  const double middle = 0.5 * (grid.size.x - 1);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const double off = std::abs(std::abs(i - middle) - distance);
        sliding.mask.values[grid.offset(i, j, k)] &= uint8_t(off <= 0.5);
      }
  return sliding;
}

MotionPair heart_pair(int size, int left_out, int frame, uint32_t seed) {
  const Grid grid = heart_grid(size);
  const int next = (frame + left_out + 1) % kHeartFrames;
  const auto at = [&](int k) {
    Volume volume{grid, std::vector<float>(grid.count())};
    for (int z = 0; z < grid.size.z; ++z)
      for (int y = 0; y < grid.size.y; ++y)
        for (int x = 0; x < grid.size.x; ++x)
          volume.values[grid.offset(x, y, z)] = float(
              shell_value(grid.lps_from_index({x, y, z}), k, kHeartFrames, 1, grid.finest_mm()));
    return volume;
  };
  MotionPair pair{at(frame), at(next), shell_truth(grid, frame, next, kHeartFrames),
                  shell_mask(grid, frame, kHeartFrames)};
  add_noise(pair, 0.01 * 900.0, seed);
  return pair;
}

MotionPair thick_pair(int size, double ratio, double structure, uint32_t seed) {
  Grid grid = cube(size);
  grid.spacing_mm.z = ratio;
  grid.size.z = std::max(6, int(std::lround(size / ratio)));
  MotionPair pair = pair_of(
      grid, [=](glm::dvec3 x) { return grain(x, structure, seed); },
      [=](glm::dvec3 x) { return swirl(size, x, 3.0); });
  add_noise(pair, 0.02 * deviation(pair.moving), seed);
  return pair;
}

}  // namespace palpate::stability
