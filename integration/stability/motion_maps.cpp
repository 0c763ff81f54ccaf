#include "integration/stability/motion_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "compute/volume/phantom.h"
#include "compute/volume/phantom_texture.h"

namespace palpate::stability {
namespace {

constexpr double kWrongShare = 0.05, kUnseenShare = 0.1;
constexpr int kHeartFrames = 12;
constexpr double kRange = 600.0;  // of a body's intensities

/// Intensities about 500, most between 200 and 800.
double tissue_of(glm::dvec3 lps_mm, double fine_mm, double coarse_mm, uint32_t seed) {
  return 500.0 + 300.0 * texture::tissue(seed, lps_mm, fine_mm, coarse_mm);
}

/// Structures of one size alone.
double grain(glm::dvec3 lps_mm, double size_mm, uint32_t seed) {
  return 500.0 + 300.0 * texture::smooth_noise(texture::mixed(seed), lps_mm / size_mm);
}

/// Turns about the middle and dies away towards the border: up to `most` mm, one to one for all
/// that is asked of it here.
glm::dvec3 swirl(int size, glm::dvec3 x, double most) {
  const glm::dvec3 r = (x - 0.5 * (size - 1)) / (0.5 * size);
  const double t = glm::dot(r, r);
  if (t >= 1.0) return glm::dvec3(0.0);
  const double fall = (1.0 - t) * (1.0 - t);
  // |r| (1 - r^2)^2 is 0.286 at most.
  return most / 0.286 * fall * glm::cross(glm::normalize(glm::dvec3(0.3, 0.5, 1.0)), r);
}

StabilityMap motion_map(const char* name, const char* title) {
  StabilityMap map;
  map.group = "motion";
  map.name = name;
  map.title = title;
  map.failed = "more than 5 % of the voxels are wrong by more than a voxel, or a voxel folds";
  map.colour = "endpoint error";
  map.colour_unit = "voxels";
  map.logarithmic = true;
  map.lowest = 0.03;
  map.highest = 10.0;
  map.sides = {{"classic Demons", "", {}},
               {"palpate", "says so (verdict, or low confidence where it is wrong)", {}}};
  return map;
}

/// Large enough for the discrete start in the full run.
int size_of(const Making& making) {
  return making.quick ? 48 : 64;
}

Making alone(Making making) {
  making.threads = 1;  // a pair takes all cores
  return making;
}

/// How many frames may be left out after this one until the outside of the wall (30 mm from the
/// middle in the smallest state) has moved by half of the wall there is; kHeartFrames: never.
double left_out_to_half_the_wall(double frame) {
  const Grid grid = heart_grid(64);
  const Mask wall = heart_shell(grid, 0, kHeartFrames);
  double first = 1e9, last = 0.0;
  for (int i = 32; i < 64; ++i)
    if (wall.values[grid.offset(i, 32, 32)]) {
      const double r = grid.lps_from_index({i, 32, 32}).x;
      first = std::min(first, r);
      last = std::max(last, r);
    }
  const double thickness = last - first + grid.finest_mm();
  // Between frames the phantom's motion goes as a cosine.
  const auto place = [&](double k) {
    const double s = 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * k / kHeartFrames));
    return s * (heart_point({last, 0.0, 0.0}, 0, kHeartFrames / 2, kHeartFrames).x - last);
  };
  for (double n = 0.0; n < kHeartFrames; n += 0.02)
    if (std::abs(place(frame + 1.0 + n) - place(frame)) >= 0.5 * thickness) return n;
  return kHeartFrames;
}

template <class Pair>
void fill_motion(StabilityMap& map, const std::shared_ptr<vulkan::Context>& context,
                 const Making& making, Colour colour, const Pair& pair) {
  fill(map, alone(making), [&](size_t side, double x, double y) {
    return motion_cell(context, pair(size_of(making), x, y, cell_seed(making.seed, x, y)),
                       side == 1, colour);
  });
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
  // At its rim the ball stands nearly still: the outside says nothing of the inside.
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
              heart_value(grid.lps_from_index({x, y, z}), k, kHeartFrames, 1, grid.finest_mm()));
    return volume;
  };
  MotionPair pair{at(frame), at(next), heart_truth(grid, frame, next, kHeartFrames),
                  heart_shell(grid, frame, kHeartFrames)};
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

Found found_by(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
               bool palpate) {
  return found(context, pair, palpate ? "balanced" : "classic", palpate);
}

Cell motion_cell(const Found& found, const MotionPair& pair, bool palpate, Colour colour) {
  const Score score = scored(found, pair);
  Cell cell{colour == Colour::kError ? score.mean_voxels : 100.0 * found.folded_share,
            Outcome::kHeld};
  if (score.wrong_share <= kWrongShare && found.folded_share == 0.0) return cell;
  const bool says = found.trust != Trust::kOk ||
                    (found.folded_share == 0.0 && score.unseen_share <= kUnseenShare);
  cell.outcome = palpate && says ? Outcome::kFlagged : Outcome::kSilent;
  return cell;
}

Cell motion_cell(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
                 bool palpate, Colour colour) {
  return motion_cell(found_by(context, pair, palpate), pair, palpate, colour);
}

StabilityMap displacement_map(const std::shared_ptr<vulkan::Context>& context,
                              const Making& making) {
  StabilityMap map = motion_map("displacement", "Large motion of small structures");
  map.made = "A body with structures of one size alone is shifted as a whole.";
  map.x = {"displacement", "voxels", log_evenly(0.5, 16.0, making.quick ? 4 : 9), true, {}};
  map.y = {
      "size of its structures", "voxels", log_evenly(3.0, 16.0, making.quick ? 3 : 6), true, {}};
  Border half{"half a structure: what a gradient can see", {}};
  for (const double s : log_evenly(2.0, 24.0, 33)) half.points.push_back({0.5 * s, s});
  map.borders = {half};
  fill_motion(map, context, making, Colour::kError, shifted_pair);
  return map;
}

StabilityMap contrast_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("contrast", "Another contrast and a bias field");
  map.made =
      "A swirl of 3 voxels; the second frame has more gain and gets brighter from left to right by "
      "a "
      "share of the intensity range.";
  map.x = {"more gain", "", log_evenly(0.01, 3.0, making.quick ? 3 : 7), true, {}};
  map.y = {
      "bias, as a share of the range", "", log_evenly(0.01, 3.0, making.quick ? 3 : 5), true, {}};
  // Where light changes the frames as much as the motion does, in the mean square, for a body of
  // mean m and deviation s with a range r:  g^2 (m^2 + s^2) + g m b r + b^2 r^2 / 3 = moved.
  const MotionPair plain = noisy_pair(size_of(making), 0.0, 3.0, making.seed);
  double moved = 0.0, mean = 0.0;
  const double n = double(plain.fixed.values.size());
  for (size_t i = 0; i < plain.fixed.values.size(); ++i) {
    const double d = double(plain.fixed.values[i]) - plain.moving.values[i];
    moved += d * d / n;
    mean += plain.moving.values[i] / n;
  }
  const double spread = deviation(plain.moving);
  Border border{"light changes the frames as much as the motion does", {}};
  for (const double g : log_evenly(0.005, 5.0, 2001)) {
    const double a = kRange * kRange / 3.0, b = g * mean * kRange;
    const double c = g * g * (mean * mean + spread * spread) - moved;
    const double bias = (-b + std::sqrt(std::max(0.0, b * b - 4.0 * a * c))) / (2.0 * a);
    if (bias > 1e-3) border.points.push_back({g, bias});
  }
  map.borders = {border};
  fill_motion(map, context, making, Colour::kError, lit_pair);
  return map;
}

StabilityMap noise_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("noise", "Noise");
  map.made =
      "A swirl in a body with structures of 6 and 13 voxels, independent noise in both frames.";
  map.x = {"noise, as a share of the body's own deviation",
           "",
           log_evenly(0.03, 3.0, making.quick ? 4 : 7),
           true,
           {}};
  map.y = {"displacement", "voxels", log_evenly(1.0, 8.0, making.quick ? 3 : 5), true, {}};
  map.borders = {{"as much noise as structure", {{1.0, 0.5}, {1.0, 16.0}}}};
  fill_motion(map, context, making, Colour::kError, noisy_pair);
  return map;
}

StabilityMap aperture_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("flat", "A region without structure (aperture)");
  map.made =
      "A ball with nothing in it but noise, whose inside moves and whose rim hardly does; scored "
      "in "
      "the ball. Nothing in the frames tells its motion.";
  map.x = {"radius of the flat ball", "voxels", {}, false, {}};
  map.y = {"motion inside", "voxels", {}, true, {}};
  map.x.at = making.quick ? std::vector{2.0, 8.0, 16.0} : evenly(0.0, 24.0, 7);
  map.y.at = making.quick ? std::vector{0.5, 2.0, 4.0} : log_evenly(0.5, 4.0, 4);
  map.borders = {{"two SDs of the window (7 voxels each): nothing within it has structure",
                  {{14.0, 0.1}, {14.0, 9.0}}}};
  fill_motion(map, context, making, Colour::kError, flat_pair);
  return map;
}

StabilityMap folding_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("folding", "Steep and folding motion");
  map.made =
      "Material that runs to and fro along one axis, u = g/k sin(k x): from g = 1 on the true "
      "motion itself folds, and no field without folds is right.";
  map.x = {"gradient of the true motion", "", evenly(0.25, 2.0, making.quick ? 3 : 8), false, {}};
  map.y = {"wavelength", "voxels", log_evenly(12.0, 60.0, making.quick ? 3 : 5), true, {}};
  map.colour = "folded voxels";
  map.colour_unit = "%";
  map.lowest = 0.01;
  map.highest = 100.0;
  map.borders = {
      {"the truth folds", {{1.0, 5.0}, {1.0, 99.0}}},
      {"a wave is as long as the window is wide (2 pi 7 voxels)", {{0.0, 44.0}, {3.0, 44.0}}}};
  fill_motion(map, context, making, Colour::kFolds, folding_pair);
  return map;
}

StabilityMap sliding_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("sliding", "Two sides that slide past each other");
  map.made =
      "Two halves slide along their common face; scored by how far from the face a voxel is.";
  map.x = {"distance from the border",
           "voxels",
           making.quick ? std::vector{0.5, 4.5, 12.5}
                        : std::vector{0.5, 1.5, 2.5, 4.5, 6.5, 8.5, 12.5, 16.5},
           false,
           {}};
  map.y = {"shift",
           "voxels",
           making.quick ? std::vector{1.0, 4.0, 12.0} : log_evenly(0.5, 16.0, 7),
           true,
           {}};
  map.borders = {{"two cells of the field (8 voxels)", {{8.0, 0.3}, {8.0, 30.0}}}};
  // One estimate serves all distances.
  struct Known {
    double shift = -1.0;
    MotionPair pair;
    Found found;
  };
  std::array<Known, 2> known;
  fill(map, alone(making), [&](size_t side, double distance, double shift) {
    Known& of = known[side];
    if (of.shift != shift) {
      of.shift = shift;
      of.pair = sliding_pair(size_of(making), shift, cell_seed(making.seed, shift, 0.0));
      of.found = found_by(context, of.pair, side == 1);
    }
    return motion_cell(of.found, scored_at(of.pair, distance), side == 1, Colour::kError);
  });
  return map;
}

StabilityMap frames_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("frames", "Missing and repeated frames");
  map.made =
      "The heart phantom in 12 frames a beat, over and over; -1 frames left out is the same "
      "frame once more with other noise. Scored in the wall.";
  map.x = {"frames left out",
           "",
           making.quick ? std::vector{-1.0, 1.0, 4.0} : evenly(-1.0, 5.0, 7),
           false,
           {}};
  map.y = {
      "frame", "", making.quick ? std::vector{0.0, 3.0, 6.0} : evenly(0.0, 11.0, 6), false, {}};
  if (!making.quick) map.y.at = {0, 3, 6, 9};
  Border half{"the wall moves by half of its thickness", {}};
  for (double frame = map.y.at.front() - 1.0; frame <= map.y.at.back() + 1.0; frame += 0.25) {
    const double left_out = left_out_to_half_the_wall(frame);
    if (left_out < kHeartFrames) half.points.push_back({left_out, frame});
  }
  map.borders = {half};
  fill_motion(map, context, making, Colour::kError,
              [](int size, double left_out, double frame, uint32_t seed) {
                return heart_pair(size, int(left_out), int(frame), seed);
              });
  return map;
}

StabilityMap anisotropy_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("slices", "Thick slices");
  map.made =
      "A swirl of 3 voxels in a body with structures of one size; slices are thicker than voxels "
      "are wide.";
  map.x = {"slice thickness over voxel width",
           "",
           making.quick ? std::vector{1.0, 3.0, 8.0} : log_evenly(1.0, 8.0, 6),
           true,
           {}};
  map.y = {
      "size of its structures", "voxels", log_evenly(4.0, 16.0, making.quick ? 3 : 5), true, {}};
  Border nyquist{"two slices a structure (Nyquist)", {}};
  for (const double ratio : log_evenly(0.7, 11.0, 33))
    nyquist.points.push_back({ratio, 2.0 * ratio});
  map.borders = {nyquist};
  fill_motion(map, context, making, Colour::kError, thick_pair);
  return map;
}

}  // namespace palpate::stability
