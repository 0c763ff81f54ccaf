#include "compute/motion/sequence_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr std::array<double, 3> kPhases = {0.25, 0.5, 0.75};
/// A path through frames leaves the straight line by less than this share of the longest of the
/// step and its two neighbours. See docs/decisions/motion-engine.md.
constexpr float kSupported = 1.0F / 3.0F;

float from_segment(glm::vec3 x, glm::vec3 a, glm::vec3 b) {
  const glm::vec3 way = b - a;
  const float square = glm::dot(way, way);
  const float share = square > 0.0F ? glm::clamp(glm::dot(x - a, way) / square, 0.0F, 1.0F) : 0.0F;
  return glm::distance(x, a + share * way);
}

/// How far `between` is from the straight line between frames 1 and 2 of four that follow each
/// other.
Excursion excursion_of(const Field& between, const std::array<const Field*, 4>& frames) {
  Excursion farthest;
  const double voxel_mm = between.grid.finest_mm();
  for (size_t s = 0; s < between.u_mm.size(); ++s) {
    std::array<glm::vec3, 4> at{};
    float longest = 0.0F;
    for (size_t n = 0; n < 4; ++n) {
      at[n] = frames[n]->u_mm[s];
      if (n > 0) longest = std::max(longest, glm::distance(at[n - 1], at[n]));
    }
    const float mm = from_segment(between.u_mm[s], at[1], at[2]);
    farthest.mm = std::max(farthest.mm, double(mm));
    farthest.beyond_voxels =
        std::max(farthest.beyond_voxels, double(mm - kSupported * longest) / voxel_mm);
  }
  return farthest;
}

}  // namespace

std::vector<Field> fields_at_frames(const SequenceMotion& motion) {
  std::vector<Field> fields;
  for (size_t k = 0; k < motion.frames(); ++k) fields.push_back(motion.at_frame(k));
  return fields;
}

SequenceMotion chained(std::span<const Field> consecutive, std::span<const double> times_s) {
  const size_t frames = times_s.size();
  SequenceMotion motion;
  for (const double time_s : times_s) motion.basis.times_s.push_back(time_s - times_s.front());
  if (consecutive.size() == frames) motion.basis.cycle_s = cycle_of(times_s);
  const Grid& grid = consecutive.front().grid;
  motion.terms.push_back(still_field(grid));
  for (size_t k = 0; k + 1 < frames; ++k) {
    Field next = motion.terms.back();
    const Field& step = consecutive[k];
    parallel_ranges(grid.size.z, 50.0 * grid.size.x * grid.size.y, [&](int begin, int end) {
      for (int z = begin; z < end; ++z)
        for (int y = 0; y < grid.size.y; ++y)
          for (int x = 0; x < grid.size.x; ++x) {
            glm::vec3& u = next.u_mm[grid.offset(x, y, z)];
            const glm::dvec3 at = grid.lps_from_index({x, y, z}) + glm::dvec3(u);
            u += glm::vec3(sample_at_lps(step, at));
          }
    });
    motion.terms.push_back(std::move(next));
  }
  return motion;
}

std::vector<double> accelerations_mm(std::span<const Field> at_frame, bool cyclic,
                                     const Mask* mask) {
  const size_t frames = at_frame.size();
  std::vector<double> result(frames, 0.0);
  for (size_t k = 0; k < frames; ++k) {
    if (!cyclic && (k == 0 || k + 1 == frames)) continue;
    const Field &before = at_frame[(k + frames - 1) % frames], &now = at_frame[k],
                &after = at_frame[(k + 1) % frames];
    double sum = 0.0;
    size_t count = 0;
    for (size_t n = 0; n < now.u_mm.size(); ++n) {
      if (mask && !mask->values[n]) continue;
      const glm::vec3 a = before.u_mm[n] - 2.0F * now.u_mm[n] + after.u_mm[n];
      sum += double(glm::dot(a, a));
      ++count;
    }
    result[k] = count > 0 ? std::sqrt(sum / double(count)) : 0.0;
  }
  return result;
}

std::vector<BetweenFrames> between_frames(const SequenceMotion& motion) {
  const auto frames = int(motion.frames());
  const bool cyclic = motion.basis.cycle_s > 0.0;
  const std::vector<Field> at_frame = fields_at_frames(motion);
  const auto frame = [&](int k) {
    const int wrapped = (k + frames) % frames;
    return &at_frame[size_t(cyclic ? wrapped : std::clamp(k, 0, frames - 1))];
  };
  std::vector<BetweenFrames> result(motion.frames());
  for (int k = 0; k < frames - (cyclic ? 0 : 1); ++k) {
    BetweenFrames& step = result[size_t(k)];
    for (const double phase : kPhases) {
      const Field between = motion.at(motion.basis.at(k, phase));
      const Folds found = folds(between);
      const bool worse = found.not_finite > step.folds.not_finite ||
                         found.folded > step.folds.folded || found.min_det < step.folds.min_det;
      if (step.folds.voxels == 0 || worse) step.folds = found;
      const Excursion here =
          excursion_of(between, {frame(k - 1), frame(k), frame(k + 1), frame(k + 2)});
      step.excursion.mm = std::max(step.excursion.mm, here.mm);
      step.excursion.beyond_voxels = std::max(step.excursion.beyond_voxels, here.beyond_voxels);
    }
  }
  return result;
}

Result<SequenceEvidence> examined(
    const SequenceMotion& motion, const std::vector<Volume>& frames,
    const std::vector<Confidence>& confidence, const Mask* mask,
    const std::function<void(const SequenceEvidence&, size_t)>& tell) {
  SequenceEvidence evidence;
  evidence.reference = motion.reference;
  evidence.frames.resize(motion.frames());
  const bool cyclic = motion.basis.cycle_s > 0.0;
  const std::vector<Field> at_frame = fields_at_frames(motion);
  const std::optional<Mask> on_terms =
      mask ? std::optional(resampled(*mask, at_frame.front().grid)) : std::nullopt;
  const Mask* const solved_mask = on_terms ? &*on_terms : nullptr;
  const auto accelerations = accelerations_mm(at_frame, cyclic, solved_mask);
  const auto between = between_frames(motion);
  const Grid& solved = at_frame.front().grid;
  const Grid& image = frames.empty() ? solved : frames.front().grid;
  std::optional<Mask> structure;
  for (size_t k = 0; k < motion.frames(); ++k) {
    FrameEvidence& frame = evidence.frames[k];
    const Field field = frames.empty() ? at_frame[k] : resampled(at_frame[k], image);
    frame.motion_mm = lengths_mm(field, frames.empty() ? solved_mask : mask);
    frame.acceleration_mm = accelerations[k];
    frame.between = between[k].folds;
    frame.excursion = between[k].excursion;
    if (frames.empty() || k == motion.reference) {
      frame.evidence.folds = folds(field);
    } else {
      Mask clear;
      auto found = examined(frames[motion.reference], frames[k], field, nullptr,
                            confidence.empty() ? nullptr : &confidence[k], mask, &clear);
      if (!found) return found.error();
      if (!structure) structure = resampled(clear, solved);
      frame.evidence = std::move(*found);
    }
    if (tell) tell(evidence, k);
  }
  FrameOrderMeter order(solved, structure ? &*structure : solved_mask, image.finest_mm());
  for (size_t k = 0; k + (cyclic ? 0 : 1) < at_frame.size(); ++k)
    order.take(at_frame[k], at_frame[(k + 1) % at_frame.size()]);
  evidence.order = order.found(cyclic);
  return evidence;
}

}  // namespace palpate
