#include "compute/motion/sequence_quality.h"

#include <cmath>
#include <optional>

#include "compute/volume/parallel.h"

namespace palpate {

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

std::vector<Folds> folds_between(const SequenceMotion& motion) {
  std::vector<Folds> result(motion.frames());
  const size_t steps = motion.frames() - (motion.basis.cycle_s > 0.0 ? 0 : 1);
  for (size_t k = 0; k < steps; ++k)
    result[k] = folds(combined(motion.terms, motion.basis.at(int(k), 0.5)));
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
  const auto between = folds_between(motion);
  const Grid& image = frames.empty() ? at_frame.front().grid : frames.front().grid;
  for (size_t k = 0; k < motion.frames(); ++k) {
    FrameEvidence& frame = evidence.frames[k];
    const Field field = frames.empty() ? at_frame[k] : resampled(at_frame[k], image);
    frame.motion_mm = lengths_mm(field, frames.empty() ? solved_mask : mask);
    frame.acceleration_mm = accelerations[k];
    frame.between = between[k];
    if (frames.empty() || k == motion.reference) {
      frame.evidence.folds = folds(field);
    } else {
      auto found = examined(frames[motion.reference], frames[k], field, nullptr,
                            confidence.empty() ? nullptr : &confidence[k], mask);
      if (!found) return found.error();
      frame.evidence = std::move(*found);
    }
    if (tell) tell(evidence, k);
  }
  return evidence;
}

}  // namespace palpate
