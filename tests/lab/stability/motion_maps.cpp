#include "tests/lab/stability/motion_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "compute/volume/phantom.h"

namespace palpate::stability {
namespace {

constexpr double kWrongShare = 0.05, kUnseenShare = 0.1;
const char* const kStructure = "size of its structures";

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
  // A pair uses all cores.
  making.threads = 1;
  return making;
}

/// The number of frames that may be left out after this one until the outside of the wall (30 mm
/// from the middle in the smallest state) has moved by half of the wall's thickness; kHeartFrames:
/// never.
double left_out_to_half_the_wall(double frame) {
  const Grid grid = heart_grid(64);
  const Mask wall = shell_mask(grid, 0, kHeartFrames);
  double first = 1e9, last = 0.0;
  for (int i = 32; i < 64; ++i)
    if (wall.values[grid.offset(i, 32, 32)]) {
      const double r = grid.lps_from_index({i, 32, 32}).x;
      first = std::min(first, r);
      last = std::max(last, r);
    }
  const double thickness = last - first + grid.finest_mm();
  // Between frames the phantom's motion is a cosine.
  const auto place = [&](double k) {
    const double s = 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * k / kHeartFrames));
    return s * (shell_point({last, 0.0, 0.0}, 0, kHeartFrames / 2, kHeartFrames).x - last);
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
  map.x = log_axis("displacement", "voxels", 0.5, 16.0, making.count(4, 9));
  map.y = log_axis(kStructure, "voxels", 3.0, 16.0, making.count(3, 6));
  map.borders = {border_along_x("half a structure: what a gradient can see",
                                log_evenly(1.0, 12.0, 33), [](double u) { return 2.0 * u; })};
  fill_motion(map, context, making, Colour::kError, shifted_pair);
  return map;
}

StabilityMap contrast_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("contrast", "Another contrast and a bias field");
  map.made =
      "A swirl of 3 voxels; the second frame has more gain and gets brighter from left to right by "
      "a share of the intensity range.";
  map.x = log_axis("more gain", "", 0.01, 3.0, making.count(3, 7));
  map.y = log_axis("bias, as a share of the range", "", 0.01, 3.0, making.count(3, 5));
  // Where the light changes the frames as much as the motion does, in the mean square, for a body
  // of mean m and deviation s with a range r: g^2 (m^2 + s^2) + g m b r + b^2 r^2 / 3 = moved.
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
  map.x =
      log_axis("noise, as a share of the body's own deviation", "", 0.03, 3.0, making.count(4, 7));
  map.y = log_axis("displacement", "voxels", 1.0, 8.0, making.count(3, 5));
  map.borders = {border_at_x("as much noise as structure", 1.0, map.y)};
  fill_motion(map, context, making, Colour::kError, noisy_pair);
  return map;
}

StabilityMap aperture_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("flat", "A region without structure (aperture)");
  map.made =
      "A ball with nothing in it but noise, whose inside moves and whose rim hardly does; scored "
      "in the ball. Nothing in the frames tells its motion.";
  map.x = {"radius of the flat ball", "voxels", {}, false, {}};
  map.y = {"motion inside", "voxels", {}, true, {}};
  map.x.at = making.quick ? std::vector{2.0, 8.0, 16.0} : evenly(0.0, 24.0, 7);
  map.y.at = making.quick ? std::vector{0.5, 2.0, 4.0} : log_evenly(0.5, 4.0, 4);
  map.borders = {border_at_x(
      "two SDs of the window (7 voxels each): nothing within it has structure", 14.0, map.y)};
  fill_motion(map, context, making, Colour::kError, flat_pair);
  return map;
}

StabilityMap folding_map(const std::shared_ptr<vulkan::Context>& context, const Making& making) {
  StabilityMap map = motion_map("folding", "Steep and folding motion");
  map.made =
      "Material that runs to and fro along one axis, u = g/k sin(k x): from g = 1 on the true "
      "motion itself folds, and no field without folds is right.";
  map.x = even_axis("gradient of the true motion", "", 0.25, 2.0, making.count(3, 8));
  map.y = log_axis("wavelength", "voxels", 12.0, 60.0, making.count(3, 5));
  map.colour = "folded voxels";
  map.colour_unit = "%";
  map.lowest = 0.01;
  map.highest = 100.0;
  map.borders = {
      border_at_x("the truth folds", 1.0, map.y),
      border_at_y("a wave is as long as the window is wide (2 pi 7 voxels)", 44.0, map.x)};
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
  map.borders = {border_at_x("two cells of the field (8 voxels)", 8.0, map.y)};
  // One estimation for all distances.
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
  map.y = log_axis(kStructure, "voxels", 4.0, 16.0, making.count(3, 5));
  map.borders = {border_along_x("two slices a structure (Nyquist)", log_evenly(0.7, 11.0, 33),
                                [](double ratio) { return 2.0 * ratio; })};
  fill_motion(map, context, making, Colour::kError, thick_pair);
  return map;
}

}  // namespace palpate::stability
