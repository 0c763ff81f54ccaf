#include "compute/volume/phantom.h"

#include <cassert>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "compute/volume/dual.h"
#include "compute/volume/grid_samples.h"
#include "compute/volume/phantom_texture.h"
#include "compute/volume/portable.h"

namespace palpate {
namespace {

// The shell, mm. The wall lies where the motion is largest; the reach ends 5 mm inside the 128 mm
// cube.
constexpr double kReachMm = 59.0;
constexpr double kAmplitudeMm = 42.0;
constexpr double kInnerMm = 15.0;
constexpr double kOuterMm = 25.0;
constexpr double kBumpMm = 2.0;
constexpr double kBumpsPerRadius = 2.5;

constexpr double kLung = 100.0;
constexpr double kBlood = 350.0;
constexpr double kWall = 1000.0;
constexpr double kEdgeVoxels = 1.5;

// The sliding pair, in shares of the volume's edge.
constexpr double kTubeHalfWidth = 0.26;
constexpr double kTubeHalfHeight = 0.32;
constexpr double kOrganLength = 0.5;
constexpr double kFluid = 100.0;
constexpr double kOrgan = 600.0;
constexpr double kBody = 400.0;
constexpr double kSlidingRange = 800.0;
constexpr double kWallBandVoxels = 5.0;

/// s_k: 0 in frame 0, 1 half a cycle later.
double beat_phase(int frame, int frames) {
  const int k = ((frame % frames) + frames) % frames;
  return 0.5 * (1.0 - portable::cos(2.0 * std::numbers::pi * k / frames));
}

/// b(r) / r, which is finite at the centre.
template <class Length>
Length stretch(const Length& r_mm) {
  const Length t = r_mm / kReachMm;
  const Length q = 1.0 - t * t;
  if (!(dual::value(q) > 0.0)) return 0.0;
  return kAmplitudeMm / kReachMm * q * q * q;
}

/// d(r + s b(r)) / dr at a material radius.
double growth_at(double r_mm, double s) {
  const double t = r_mm / kReachMm;
  const double q = std::max(0.0, 1.0 - t * t);
  return 1.0 + s * kAmplitudeMm / kReachMm * q * q * (1.0 - 7.0 * t * t);
}

/// The material radius r with r + s b(r) = radius_mm, by Newton. b is concave or flat enough (b' >
/// -0.47) that the iteration contracts from everywhere; 1e-12 mm is reached in about five steps.
double material_radius(double radius_mm, double s) {
  double r = radius_mm;
  for (int step = 0; step < 50; ++step) {
    const double slope = growth_at(r, s);
    const double miss = r * (1.0 + s * stretch(r)) - radius_mm;
    r -= miss / slope;
    if (std::abs(miss) < 1e-12) break;
  }
  return r;
}

/// By the implicit function: dr / d radius = 1 / growth.
dual::Dual material_radius(const dual::Dual& radius_mm, double s) {
  const double r = material_radius(radius_mm.value, s);
  return dual::chained(radius_mm, r, 1.0 / growth_at(r, s));
}

/// Material point (position in the smallest state) of what is at lps_mm when the phase is s.
template <class Point>
Point shell_material(const Point& lps_mm, double s) {
  const auto radius_mm = dual::length(lps_mm);
  return lps_mm / (1.0 + s * stretch(material_radius(radius_mm, s)));
}

/// The inner radius of the wall in the material state, in the direction of a material point r from
/// the centre.
template <class Point, class Length>
Length inner_radius(const Point& material_mm, const Length& r, uint32_t seed) {
  const Length bump =
      texture::smooth_noise(texture::mixed(seed + 7), material_mm * (kBumpsPerRadius / r));
  return kInnerMm + kBumpMm * bump;
}

double inner_radius(glm::dvec3 material_mm, uint32_t seed) {
  return inner_radius(material_mm, std::max(1e-6, glm::length(material_mm)), seed);
}

template <class Point>
auto material_value(const Point& material_mm, double growth, double edge_mm, uint32_t seed) {
  const auto r = dual::length(material_mm);
  using Length = std::remove_cvref_t<decltype(r)>;
  const Length away = dual::value(r) > 1e-6 ? r : Length(1e-6);
  // Lengths along the radius are `growth` times longer in the frame than in the material state; the
  // scanner's blur belongs to the frame.
  const Length outside = (r - kOuterMm) * growth;
  const auto lung = [&]() -> Length {
    return kLung + 80.0 * texture::tissue(seed + 30, material_mm, 5.0, 11.0);
  };
  // Only what is there is computed: most of the box is lung.
  const Length out = texture::soft_step(outside, edge_mm);
  if (dual::value(out) >= 1.0) return lung();
  const Length inside = (r - inner_radius(material_mm, away, seed)) * growth;
  const Length blood = kBlood + 40.0 * texture::tissue(seed + 10, material_mm, 5.0, 9.0);
  const Length wall = kWall + 150.0 * texture::tissue(seed + 20, material_mm, 4.0, 8.0);
  const Length filled = blood + (wall - blood) * texture::soft_step(inside, edge_mm);
  return dual::value(out) > 0.0 ? Length(filled + (lung() - filled) * out) : filled;
}

/// The growth at the outer wall is used for the whole wall: it only scales the blur, which is wrong
/// by at most 10 % elsewhere.
double wall_growth(double s) {
  const double t2 = (kOuterMm / kReachMm) * (kOuterMm / kReachMm);
  return 1.0 + s * kAmplitudeMm / kReachMm * (1.0 - t2) * (1.0 - t2) * (1.0 - 7.0 * t2);
}

Volume shell_frame(const Grid& grid, double s, uint32_t seed, uint32_t noise_seed,
                   double noise_sd) {
  Volume frame{grid, std::vector<float>(grid.count())};
  const double voxel_mm =
      portable::cube_root(grid.spacing_mm.x * grid.spacing_mm.y * grid.spacing_mm.z);
  const double growth = wall_growth(s);
  for_each_sample(grid, 500.0, [&](size_t offset, glm::dvec3 lps_mm) {
    const double value =
        material_value(shell_material(lps_mm, s), growth, kEdgeVoxels * voxel_mm, seed);
    const double error = noise_sd * texture::gaussian_like(noise_seed, offset);
    frame.values[offset] = float(value + error);
  });
  return frame;
}

/// The geometry of the sliding pair in voxels, which are mm.
struct SlidingTube {
  glm::dvec2 centre, half;
  double organ_start, organ_end, length, shift;

  SlidingTube(int size, double shift_voxels)
      : centre(0.5 * (size - 1)),
        half(kTubeHalfWidth * size, kTubeHalfHeight * size),
        organ_start(0.5 * (size - 1) - 0.5 * (kOrganLength * size + shift_voxels)),
        organ_end(organ_start + kOrganLength * size),
        length(size - 1.0),
        shift(shift_voxels) {}

  /// Distance to the side of the tube, first order, positive outside.
  double beyond_side(glm::dvec3 p) const {
    const glm::dvec2 scaled = (glm::dvec2(p) - centre) / half;
    const double rho = std::max(1e-6, glm::length(scaled));
    return (rho - 1.0) * rho / glm::length(scaled / half + glm::dvec2(1e-9));
  }
  /// u along k inside the tube.
  double slide(double k) const {
    if (k < organ_start) return shift * k / organ_start;
    if (k > organ_end) return shift * (length - k) / (length - organ_end);
    return shift;
  }
};

Volume sliding_frame(const Grid& grid, const SlidingTube& tube, double shift, uint32_t seed,
                     uint32_t noise_seed, double noise_sd) {
  Volume frame{grid, std::vector<float>(grid.count())};
  for_each_sample(grid, 300.0, [&](size_t offset, glm::dvec3 p) {
    const glm::dvec3 in_organ = p - glm::dvec3(0.0, 0.0, shift);
    const double organ = kOrgan + 250.0 * texture::tissue(seed + 10, in_organ, 5.0, 11.0);
    const double body = kBody + 250.0 * texture::tissue(seed + 20, p, 5.0, 11.0);
    const double present = texture::soft_step(in_organ.z - tube.organ_start, kEdgeVoxels) *
                           texture::soft_step(tube.organ_end - in_organ.z, kEdgeVoxels);
    const double content = kFluid + (organ - kFluid) * present;
    const double value =
        content + (body - content) * texture::soft_step(tube.beyond_side(p), kEdgeVoxels);
    const double error = noise_sd * texture::gaussian_like(noise_seed, offset);
    frame.values[offset] = float(value + error);
  });
  return frame;
}

}  // namespace

Grid heart_grid(int size) {
  assert(size > 0);
  Grid grid;
  grid.size = glm::ivec3(size);
  grid.spacing_mm = glm::dvec3(128.0 / size);
  grid.origin_mm = -0.5 * grid.spacing_mm * double(size - 1);
  return grid;
}

Sequence shell_phantom(const Grid& grid, int frames, uint32_t seed, double noise) {
  assert(frames > 0);
  Sequence sequence;
  sequence.name = "beating-shell phantom";
  sequence.times_known = true;
  for (int k = 0; k < frames; ++k) {
    const uint32_t noise_seed = texture::mixed(seed + 1000003U * uint32_t(k + 1));
    sequence.frames.push_back(
        shell_frame(grid, beat_phase(k, frames), seed, noise_seed, noise * (kWall - kLung)));
    sequence.times_s.push_back(double(k) / frames);
  }
  return sequence;
}

Sequence shell_phantom(int size, int frames, uint32_t seed, double noise) {
  return shell_phantom(heart_grid(size), frames, seed, noise);
}

double shell_value(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed, double voxel_mm) {
  const double s = beat_phase(frame, frames);
  return material_value(shell_material(lps_mm, s), wall_growth(s), kEdgeVoxels * voxel_mm, seed);
}

glm::dvec3 shell_gradient(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed,
                          double voxel_mm) {
  const double s = beat_phase(frame, frames);
  const dual::Point material_mm = shell_material(dual::variable(lps_mm), s);
  return material_value(material_mm, wall_growth(s), kEdgeVoxels * voxel_mm, seed).slope;
}

namespace {

glm::dvec3 shell_point(glm::dvec3 lps_mm, double from_phase, double to_phase) {
  const glm::dvec3 material_mm = shell_material(lps_mm, from_phase);
  return material_mm * (1.0 + to_phase * stretch(glm::length(material_mm)));
}

}  // namespace

glm::dvec3 shell_point(glm::dvec3 lps_mm, int from_frame, int to_frame, int frames) {
  return shell_point(lps_mm, beat_phase(from_frame, frames), beat_phase(to_frame, frames));
}

Field shell_truth(const Grid& grid, int from_frame, int to_frame, int frames) {
  Field truth = still_field(grid);
  const double from_phase = beat_phase(from_frame, frames), to_phase = beat_phase(to_frame, frames);
  for_each_sample(grid, 100.0, [&](size_t offset, glm::dvec3 lps_mm) {
    truth.u_mm[offset] = glm::vec3(shell_point(lps_mm, from_phase, to_phase) - lps_mm);
  });
  return truth;
}

Mask shell_mask(const Grid& grid, int frame, int frames, uint32_t seed) {
  Mask shell{grid, std::vector<uint8_t>(grid.count())};
  const double s = beat_phase(frame, frames);
  for_each_sample(grid, 150.0, [&](size_t offset, glm::dvec3 lps_mm) {
    const glm::dvec3 material_mm = shell_material(lps_mm, s);
    const double r = glm::length(material_mm);
    shell.values[offset] = r <= kOuterMm && r >= inner_radius(material_mm, seed);
  });
  return shell;
}

SlidingPhantom sliding_phantom(int size, double shift_voxels, uint32_t seed, double noise) {
  assert(std::abs(shift_voxels) < size / 3.0);
  Grid grid;
  grid.size = glm::ivec3(size);
  const SlidingTube tube(size, shift_voxels);
  const double noise_sd = noise * kSlidingRange;
  const auto frame = [&](double shift, uint32_t noise_seed) {
    return sliding_frame(grid, tube, shift, seed, texture::mixed(noise_seed), noise_sd);
  };
  SlidingPhantom result{frame(0.0, seed + 101), frame(shift_voxels, seed + 202), still_field(grid),
                        Mask{grid, std::vector<uint8_t>(grid.count())},
                        Mask{grid, std::vector<uint8_t>(grid.count())}};
  const double low = std::min(tube.organ_start, tube.organ_start + shift_voxels);
  const double high = std::max(tube.organ_end, tube.organ_end + shift_voxels);
  for_each_sample(grid, 30.0, [&](size_t offset, glm::dvec3 p) {
    const double beyond = tube.beyond_side(p);
    if (beyond < 0.0) {
      result.truth.u_mm[offset].z = float(tube.slide(p.z));
      result.organ.values[offset] = p.z >= tube.organ_start && p.z <= tube.organ_end;
    } else {
      result.wall.values[offset] = beyond <= kWallBandVoxels && p.z >= low && p.z <= high;
    }
  });
  return result;
}

}  // namespace palpate
