#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "compute/volume/phantom_texture.h"
#include "integration/files/read_volume.h"
#include "tests/lab/bench/anatomies.h"
#include "tests/lab/bench/tools.h"

/// Pairs of large motion: fixed(x) = gain(x) image(x + u(x)) + noise, moving = image + other noise.
/// u is given by a formula, so that the truth is exact.
namespace palpate::bench {
namespace {

namespace fs = std::filesystem;

/// The source of an image and the motion of its material. Lengths in voxels of the finest axis.
struct Motion {
  int axis = 2;            ///< of the image, along which the material moves
  double amplitude = 0.0;  ///< towards higher indices if positive
  enum class Kind { kFading, kSliding, kNarrow, kFine } kind = Kind::kFading;
  double noise = 0.1;  ///< SD of each frame's noise, as a share of the SD of the image in its mask
  /// The change of brightness of fixed: brighter by this at one end, darker at the other.
  double gain = 0.0;
  uint32_t seed = 1;
};

// Mean slope of the motion where it begins.
constexpr double kSlope = 0.5;
constexpr double kSideways = 0.15;  // motion along the other axes, as a share
constexpr double kRadius = 0.62;    // of the sliding cylinder, as a share of the image's half width
constexpr double kNarrowRadius = 0.75;  // of a narrow cylinder, as a share of the motion
constexpr double kNarrowSoft = 0.75;    // width of its edge, as a share of the motion
// Of blurring, SD 5 voxels: the coarse part, which kFine removes.
constexpr int kMeanRounds = 50;
constexpr double kBorderSoft = 2.0;   // voxels: width of the jump
constexpr double kBorderReach = 5.0;  // voxels on each side of the border that count as near it

/// (1 2 1)/4 along each axis, this many times: a Gaussian of SD sqrt(times / 2) voxels.
Volume blurred(Volume image, int times) {
  const glm::ivec3 n = image.grid.size;
  for (int round = 0; round < 3 * times; ++round) {
    const int axis = round % 3;
    const Volume from = image;
    for (int k = 0; k < n.z; ++k)
      for (int j = 0; j < n.y; ++j)
        for (int i = 0; i < n.x; ++i) {
          glm::ivec3 before(i, j, k), after(i, j, k);
          before[axis] = std::max(0, before[axis] - 1);
          after[axis] = std::min(n[axis] - 1, after[axis] + 1);
          image.values[from.grid.offset(i, j, k)] =
              0.25F * (from.at(before.x, before.y, before.z) + from.at(after.x, after.y, after.z)) +
              0.5F * from.at(i, j, k);
        }
  }
  return image;
}

/// The moving material: the image, a little blurred, so that its own noise, which both frames would
/// share, gets small; or only its fine structures.
Volume material(const Volume& source, Motion::Kind kind) {
  Volume image = blurred(source, 1);
  if (kind != Motion::Kind::kFine) return image;
  const Volume mean = blurred(image, kMeanRounds);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] -= mean.values[i];
  return image;
}

/// The motion of an image, at places in voxels of its finest axis.
class Moved {
 public:
  Moved(const Grid& grid, const Motion& motion)
      : motion_(motion),
        extent_(glm::dvec3(grid.size - 1) * grid.spacing_mm / grid.finest_mm()),
        b_((motion.axis + 1) % 3),
        c_((motion.axis + 2) % 3) {}

  /// Share of the motion along its axis: 0 at one end, 1 at the other.
  double along(glm::dvec3 q) const {
    const double length = extent_[motion_.axis];
    const double rise = std::min(0.8 * length, 1.5 * std::abs(motion_.amplitude) / kSlope);
    return texture::soft_step(q[motion_.axis] - 0.1 * length - 0.5 * rise, rise);
  }
  /// Distance from the axis through the middle, 1 at the sides of the image.
  double radius(glm::dvec3 q) const {
    const glm::dvec3 r = 2.0 * q / extent_ - 1.0;
    return std::hypot(r[b_], r[c_]);
  }
  /// Voxels from the border of the sliding cylinder, roughly; positive inside.
  double inside(glm::dvec3 q) const {
    if (motion_.kind == Motion::Kind::kNarrow) {
      const glm::dvec3 r = q - 0.5 * extent_;
      return kNarrowRadius * std::abs(motion_.amplitude) - std::hypot(r[b_], r[c_]);
    }
    return (kRadius - radius(q)) * 0.5 * std::min(extent_[b_], extent_[c_]);
  }
  glm::dvec3 u(glm::dvec3 q) const {
    glm::dvec3 u(0.0);
    if (motion_.kind == Motion::Kind::kSliding || motion_.kind == Motion::Kind::kNarrow) {
      const double soft = motion_.kind == Motion::Kind::kNarrow
                              ? kNarrowSoft * std::abs(motion_.amplitude)
                              : kBorderSoft;
      u[motion_.axis] =
          motion_.amplitude * along(q) * (0.1 + 0.9 * texture::soft_step(inside(q), soft));
      return u;
    }
    const double share = along(q) * (0.2 + 0.8 * texture::soft_step(0.75 - radius(q), 0.9));
    const double phase = 2.0 * std::numbers::pi * q[motion_.axis] / extent_[motion_.axis];
    u[motion_.axis] = motion_.amplitude * share;
    u[b_] = kSideways * motion_.amplitude * share * std::sin(phase);
    u[c_] = kSideways * motion_.amplitude * share * std::cos(phase);
    return u;
  }
  double gain(glm::dvec3 q) const {
    return 1.0 + motion_.gain * std::cos(std::numbers::pi * q[b_] / extent_[b_]);
  }

 private:
  const Motion motion_;
  const glm::dvec3 extent_;
  const int b_, c_;
};

double deviation(const Volume& image, const Mask& mask) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (size_t i = 0; i < image.values.size(); ++i) {
    if (!mask.values[i]) continue;
    sum += image.values[i];
    squares += double(image.values[i]) * image.values[i];
    ++count;
  }
  return count > 0.0 ? std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)))
                     : 0.0;
}

KnownCase moved_pair(const Volume& source, const Mask& seen, const Motion& motion) {
  const Volume image = material(source, motion.kind);
  const Grid& grid = image.grid;
  const double h = grid.finest_mm();
  const double noise_sd = motion.noise * deviation(image, seen);
  const Moved moved(grid, motion);
  const auto noise = [&](uint32_t frame, size_t at) {
    return noise_sd * texture::gaussian_like(2 * motion.seed + frame, at);
  };
  KnownCase pair{
      image, image, still_field(grid), Mask{grid, std::vector<uint8_t>(grid.count())}, {}};
  const bool slides = motion.kind == Motion::Kind::kSliding;
  const bool narrow = motion.kind == Motion::Kind::kNarrow;
  if (slides) pair.border = pair.mask;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const size_t at = grid.offset(i, j, k);
        const glm::dvec3 q = glm::dvec3(i, j, k) * grid.spacing_mm / h;
        const glm::dvec3 u_mm = moved.u(q) * h;
        const glm::dvec3 there = glm::dvec3(i, j, k) + u_mm / grid.spacing_mm;
        pair.truth.u_mm[at] = glm::vec3(grid.direction * u_mm);
        pair.fixed.values[at] = float(moved.gain(q) * cubic(image, there) + noise(0, at));
        pair.moving.values[at] = float(image.values[at] + noise(1, at));
        // Scored where both frames show the material.
        const glm::ivec3 nearest(glm::round(there));
        const bool in = nearest == glm::clamp(nearest, glm::ivec3(1), grid.size - 2) &&
                        seen.values[grid.offset(nearest.x, nearest.y, nearest.z)];
        pair.mask.values[at] = in && (!narrow || (moved.inside(q) > 0.0 && moved.along(q) > 0.1));
        if (pair.border)
          pair.border->values[at] =
              in && std::abs(moved.inside(q)) <= kBorderReach && moved.along(q) > 0.5;
      }
  return pair;
}

}  // namespace

std::vector<CaseSource> large_motion_cases(const fs::path& data) {
  std::vector<CaseSource> all;
  uint32_t seed = 100;
  const auto add = [&](const char* anatomy, const fs::path& image, const fs::path& mask, int axis,
                       std::array<double, 3> amplitudes) {
    if (!fs::exists(image) || !fs::exists(mask)) return;
    using Kind = Motion::Kind;
    struct Wanted {
      const char* name;
      Kind kind;
      size_t amplitude;
      double noise, gain;
    };
    for (const Wanted& wanted : {Wanted{"fading", Kind::kFading, 0, 0.1, 0.0},
                                 Wanted{"sliding", Kind::kSliding, 1, 0.1, 0.25},
                                 Wanted{"fading", Kind::kFading, 2, 0.2, 0.25},
                                 Wanted{"narrow", Kind::kNarrow, 2, 0.1, 0.0},
                                 Wanted{"fine", Kind::kFine, 1, 0.2, 0.25}}) {
      const double amplitude = amplitudes[wanted.amplitude];
      const Motion motion{axis, amplitude, wanted.kind, wanted.noise, wanted.gain, ++seed};
      all.push_back({anatomy,
                     std::string("large_") + anatomy + "_" + wanted.name + "_" +
                         std::to_string(int(std::abs(amplitude))),
                     [image, mask, motion] {
                       return moved_pair(value_or_throw(files::read_volume(image)),
                                         value_or_throw(files::read_mask(mask)), motion);
                     }});
    }
  };
  // The image of a pair, and the amplitudes of three motions.
  const auto kit = [&](const char* pair, const char* anatomy, int axis,
                       std::array<double, 3> amplitudes) {
    add(anatomy, data / "kit" / pair / "fixed.mha", data / "kit" / pair / "mask.mha", axis,
        amplitudes);
  };
  kit("bodypet_breathing", "bodypet", 2, {6.0, 9.0, -12.0});
  kit("chestct_breathing", "chestct", 2, {12.0, -16.0, 22.0});
  kit("headmr_waves", "headmr", 1, {-12.0, 18.0, 24.0});
  kit("spineus_breathing", "spineus", 0, {12.0, 18.0, -24.0});
  kit("thoraxmr_bspline", "thoraxmr", 1, {-12.0, 18.0, 24.0});
  kit("tooth_bspline", "tooth", 2, {12.0, -18.0, 24.0});
  add("lung", data / "lung" / "pair_fixed.mha", data / "lung" / "pair_body.mha", 2,
      {-12.0, 16.0, 24.0});
  return all;
}

}  // namespace palpate::bench
