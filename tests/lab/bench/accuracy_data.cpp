#include "tests/lab/bench/accuracy_data.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"

namespace palpate::bench {
namespace {

/// A table "point,x0,y0,z0,x1,..." with comments; every row has a point's place in all frames.
Result<std::vector<std::vector<glm::dvec3>>> read_points(const std::filesystem::path& file,
                                                         size_t frames) {
  std::ifstream in(file);
  std::vector<std::vector<glm::dvec3>> points(frames);
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#' || line[0] == 'p') continue;
    std::istringstream row(line);
    std::vector<double> values;
    for (std::string word; std::getline(row, word, ',');)
      values.push_back(std::strtod(word.c_str(), nullptr));
    if (values.size() != 1 + 3 * frames) {
      return Error{ErrorKind::kBadInput, "The file " + file.string() + " has a row of " +
                                             std::to_string(values.size()) + " values instead of " +
                                             std::to_string(1 + 3 * frames) +
                                             ": take a whole one."};
    }
    for (size_t k = 0; k < frames; ++k)
      points[k].emplace_back(values[1 + 3 * k], values[2 + 3 * k], values[3 + 3 * k]);
  }
  if (points[0].empty())
    return Error{ErrorKind::kBadInput,
                 "The file " + file.string() + " has no points: is it there?"};
  return points;
}

Result<peers::KnownPair> step(const std::filesystem::path& lung, const Sequence& frames, size_t k) {
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
  return peers::KnownPair{frames.frames[k], frames.frames[k + 1], std::move(*truth),
                          std::move(*body)};
}

}  // namespace

Result<LungData> read_lung(const std::filesystem::path& data) {
  const std::filesystem::path lung = data / "lung";
  LungData result;
  auto pair = peers::read_known_pair((lung / "pair").string());
  if (!pair) return pair.error();
  result.pair = std::move(*pair);
  auto frames = files::read_sequence({lung / "breathing.seq.nrrd"});
  if (!frames) return frames.error();
  result.breathing = std::move(*frames);
  auto step_1 = step(lung, result.breathing, 1);
  if (!step_1) return step_1.error();
  result.step_1 = std::move(*step_1);
  auto step_3 = step(lung, result.breathing, 3);
  if (!step_3) return step_3.error();
  result.step_3 = std::move(*step_3);
  auto points = read_points(lung / "breathing_points.csv", result.breathing.frames.size());
  if (!points) return points.error();
  result.points_lps_mm = std::move(*points);
  return result;
}

peers::KnownPair with_gain(const peers::KnownPair& pair, double gain) {
  constexpr double kAir = -1000.0;
  peers::KnownPair result = pair;
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
