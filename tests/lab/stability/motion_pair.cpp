#include "tests/lab/stability/motion_pair.h"

#include <cmath>
#include <stdexcept>

#include "compute/volume/parallel.h"
#include "compute/volume/phantom_texture.h"

namespace palpate::stability {
namespace {

constexpr double kMargin_voxels = 4.0;
constexpr double kSampleCost = 200.0;

template <class Work>
void each_voxel(const Grid& grid, const Work& work) {
  parallel_ranges(grid.size.z, kSampleCost * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) work(glm::dvec3(i, j, k), grid.offset(i, j, k));
  });
}

bool inside(const Grid& grid, glm::dvec3 index) {
  // A margin in mm, so that it is the same along a coarse axis.
  const glm::dvec3 margin = kMargin_voxels * grid.finest_mm() / grid.spacing_mm;
  return glm::all(glm::greaterThanEqual(index, margin)) &&
         glm::all(glm::lessThanEqual(index, glm::dvec3(grid.size - 1) - margin));
}

PairMotion estimated(const std::shared_ptr<vulkan::Context>& context, const Volume& fixed,
                     const Volume& moving, const std::string& preset) {
  EstimatorOptions options;
  options.motion = motion_preset(preset).value();
  auto motion = estimate_motion(context, fixed, moving, options);
  if (!motion) throw std::runtime_error(motion.error().message);
  return std::move(*motion);
}

double confidence_at(const Confidence& confidence, glm::dvec3 lps_mm) {
  const glm::dvec3 index = confidence.grid.index_from_lps(lps_mm);
  const glm::ivec3 i =
      glm::clamp(glm::ivec3(glm::round(index)), glm::ivec3(0), confidence.grid.size - 1);
  return confidence.values[confidence.grid.offset(i.x, i.y, i.z)];
}

}  // namespace

Grid cube(int size) {
  Grid grid;
  grid.size = glm::ivec3(size);
  return grid;
}

MotionPair pair_of(const Grid& grid, const std::function<double(glm::dvec3)>& body,
                   const std::function<glm::dvec3(glm::dvec3)>& u_mm) {
  MotionPair pair;
  pair.fixed = pair.moving = Volume{grid, std::vector<float>(grid.count())};
  pair.truth = still_field(grid);
  pair.mask = Mask{grid, std::vector<uint8_t>(grid.count())};
  each_voxel(grid, [&](glm::dvec3 index, size_t at) {
    const glm::dvec3 x = grid.lps_from_index(index), u = u_mm(x);
    pair.truth.u_mm[at] = glm::vec3(u);
    pair.fixed.values[at] = float(body(x + u));
    pair.moving.values[at] = float(body(x));
    pair.mask.values[at] = inside(grid, index) && inside(grid, grid.index_from_lps(x + u)) ? 1 : 0;
  });
  return pair;
}

void add_noise(MotionPair& pair, double sd, uint32_t seed) {
  each_voxel(pair.fixed.grid, [&](glm::dvec3, size_t at) {
    pair.fixed.values[at] += float(sd * texture::gaussian_like(texture::mixed(seed), at));
    pair.moving.values[at] += float(sd * texture::gaussian_like(texture::mixed(seed + 1), at));
  });
}

double deviation(const Volume& volume) {
  double sum = 0.0, squares = 0.0;
  for (const float v : volume.values) {
    sum += v;
    squares += double(v) * v;
  }
  const double n = double(volume.values.size());
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

Found found(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
            const std::string& preset, bool judge) {
  PairMotion there = estimated(context, pair.fixed, pair.moving, preset);
  Found result;
  if (judge) {
    const PairMotion back = estimated(context, pair.moving, pair.fixed, preset);
    const auto evidence =
        examined(pair.fixed, pair.moving, there.field, &back.field, &there.confidence);
    if (!evidence) throw std::runtime_error(evidence.error().message);
    result.trust = judged(*evidence).trust;
  }
  const Folds folded = folds(there.field);
  result.folded_share = double(folded.folded) / double(std::max<size_t>(1, folded.voxels));
  result.field = std::move(there.field);
  result.confidence = std::move(there.confidence);
  return result;
}

Score scored(const Found& found, const MotionPair& pair) {
  const Grid& grid = pair.fixed.grid;
  const double voxel_mm = grid.finest_mm();
  size_t count = 0, wrong = 0, unseen = 0;
  double sum = 0.0;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const size_t at = grid.offset(i, j, k);
        if (!pair.mask.values[at]) continue;
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        const glm::dvec3 off = sample_at_lps(found.field, x) - glm::dvec3(pair.truth.u_mm[at]);
        const double error = glm::length(off) / voxel_mm;
        ++count;
        sum += error;
        if (error <= 1.0) continue;
        ++wrong;
        unseen += confidence_at(found.confidence, x) >= kLowConfidence;
      }
  if (!count) throw std::runtime_error("Nothing of the pair is seen in both frames.");
  return {sum / double(count), double(wrong) / double(count),
          wrong ? double(unseen) / double(wrong) : 0.0};
}

}  // namespace palpate::stability
