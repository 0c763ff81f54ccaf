#include <algorithm>
#include <array>
#include <cmath>

#include "compute/motion/noise.h"
#include "compute/volume/parallel.h"
#include "compute/volume/phantom.h"
#include "compute/volume/phantom_texture.h"
#include "tests/lab/bench/anatomies.h"

/// Pairs with known motion in other sizes than they were made in.
namespace palpate::bench {
namespace {

constexpr double kMeanCost = 10.0, kCubicCost = 500.0;  // ns of a voxel

template <class Value>
Volume filled(const Grid& grid, double cost, const Value& value) {
  Volume volume{grid, std::vector<float>(grid.count())};
  parallel_ranges(grid.size.z, cost * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const size_t at = grid.offset(i, j, k);
          volume.values[at] = float(value(glm::ivec3(i, j, k), at));
        }
  });
  return volume;
}

Volume halved(const Volume& image) {
  Grid grid = image.grid;
  grid.size = glm::max(grid.size / 2, glm::ivec3(1));
  grid.spacing_mm *= 2.0;
  grid.origin_mm = image.grid.lps_from_index(glm::dvec3(0.5));
  return filled(grid, kMeanCost, [&](glm::ivec3 i, size_t) {
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 at = 2 * i + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
      sum += image.at(at.x, at.y, at.z);
    }
    return sum / 8.0;
  });
}

Volume doubled(const Volume& image, uint32_t seed) {
  Grid grid = image.grid;
  grid.size = 2 * grid.size - 1;
  grid.spacing_mm /= 2.0;
  const double noise = noise_sd(image);
  return filled(grid, kCubicCost, [&](glm::ivec3 i, size_t at) {
    return cubic(image, 0.5 * glm::dvec3(i)) + noise * texture::gaussian_like(seed, at);
  });
}

KnownCase fine_shell(int frames) {
  Sequence heart = shell_phantom(heart_grid(256), frames);
  const Grid grid = heart.frames[0].grid;
  return {std::move(heart.frames[0]),
          std::move(heart.frames[1]),
          shell_truth(grid, 0, 1, frames),
          shell_mask(grid, 0, frames),
          {}};
}

}  // namespace

double cubic(const Volume& image, glm::dvec3 index) {
  const glm::dvec3 base = glm::floor(index);
  std::array<std::array<double, 4>, 3> weights{};
  for (int a = 0; a < 3; ++a) {
    const double t = index[a] - base[a];
    weights[size_t(a)] = {((2.0 - t) * t - 1.0) * t / 2.0, ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
                          ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0, (t - 1.0) * t * t / 2.0};
  }
  double sum = 0.0;
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b)
      for (int a = 0; a < 4; ++a) {
        const glm::ivec3 at = glm::clamp(glm::ivec3(base) + glm::ivec3(a, b, c) - 1, glm::ivec3(0),
                                         image.grid.size - 1);
        sum += weights[0][size_t(a)] * weights[1][size_t(b)] * weights[2][size_t(c)] *
               image.at(at.x, at.y, at.z);
      }
  return sum;
}

std::vector<CaseSource> sized_cases(const std::filesystem::path& data) {
  std::vector<CaseSource> all;
  // One of each anatomy: in double size a pair takes eight times as long.
  constexpr std::array kTwice = {"bodypet_breathing", "chestct_breathing", "headmr_waves",
                                 "spineus_bspline",   "thoraxmr_bspline",  "tooth_bspline",
                                 "lung_pair"};
  for (const CaseSource& source : known_cases(data)) {
    if (source.anatomy == "shell" || source.anatomy == "made") continue;
    all.push_back({source.anatomy, "half_" + source.name, [make = source.make] {
                     KnownCase pair = make();
                     pair.fixed = halved(pair.fixed);
                     pair.moving = halved(pair.moving);
                     return pair;
                   }});
    if (std::find(kTwice.begin(), kTwice.end(), source.name) == kTwice.end()) continue;
    all.push_back({source.anatomy, "twice_" + source.name, [make = source.make] {
                     KnownCase pair = make();
                     pair.fixed = doubled(pair.fixed, 1);
                     pair.moving = doubled(pair.moving, 2);
                     return pair;
                   }});
  }
  all.push_back({"shell", "shell_256", [] { return fine_shell(kShellFrames); }});
  all.push_back({"shell", "shell_256_tenth", [] { return fine_shell(10); }});
  return all;
}

}  // namespace palpate::bench
