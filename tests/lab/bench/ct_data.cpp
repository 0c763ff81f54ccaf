#include "tests/lab/bench/ct_data.h"

#include <cmath>
#include <numbers>

#include "integration/files/landmarks.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/lab/bench/inputs.h"

namespace palpate::bench {
namespace {

Result<studies::MotionCase> step(const std::filesystem::path& lung, const Sequence& frames,
                                 size_t k) {
  const std::string from = std::to_string(k), to = std::to_string(k + 1);
  auto truth = files::read_field(lung / ("breathing_truth_" + from + "_to_" + to + ".mha"));
  if (!truth) return truth.error();
  auto body = files::read_mask(lung / ("breathing_body_" + from + ".mha"));
  if (!body) return body.error();
  if (k + 1 >= frames.frames.size() || !same_geometry(truth->grid, frames.frames[k].grid) ||
      !same_geometry(body->grid, frames.frames[k].grid)) {
    return Error{ErrorKind::kBadInput, "The truth of frames " + from + " to " + to + " in " +
                                           lung.string() +
                                           " is not on the grid of the frames: take one set."};
  }
  studies::MotionCase known;
  known.id = "step" + from;
  known.name = "Real chest CT, breathing, frame " + from + " to " + to;
  known.fixed = frames.frames[k];
  known.moving = frames.frames[k + 1];
  known.truth = std::move(*truth);
  known.mask = std::move(*body);
  return known;
}

}  // namespace

Result<CtData> read_ct(const std::filesystem::path& data) {
  const std::filesystem::path lung = data / "lung";
  CtData result;
  auto breath = read_known_ct(lung);
  if (!breath) return breath.error();
  if (!*breath)
    return Error{ErrorKind::kBadInput, "There is no chest CT in " + lung.string() +
                                           ": name the folder with lung/ as --data."};
  result.breath = std::move(**breath);
  auto frames = files::read_sequence({lung / "breathing.seq.nrrd"});
  if (!frames) return frames.error();
  result.breathing = std::move(*frames);
  for (const size_t k : {1, 3}) {
    auto known = step(lung, result.breathing, k);
    if (!known) return known.error();
    result.steps.push_back(std::move(*known));
  }
  for (size_t k = 0; k < result.breathing.frames.size(); ++k) {
    auto points = files::read_followed_points(lung / "breathing_points.csv", int(k));
    if (!points) return points.error();
    result.points_lps_mm.push_back(std::move(points->points_lps_mm));
  }
  return result;
}

studies::MotionCase with_gain(const studies::MotionCase& pair, double gain) {
  constexpr double kAir = -1000.0;
  studies::MotionCase result = pair;
  const glm::ivec3 size = pair.moving.grid.size;
  for (int k = 0; k < size.z; ++k) {
    for (int j = 0; j < size.y; ++j) {
      const double bias = 1.0 - 0.2 * std::cos(std::numbers::pi * (j + 0.5) / size.y);
      for (int i = 0; i < size.x; ++i) {
        float& value = result.moving.values[pair.moving.grid.offset(i, j, k)];
        value = float(kAir + (double(value) - kAir) * gain * bias);
      }
    }
  }
  return result;
}

}  // namespace palpate::bench
