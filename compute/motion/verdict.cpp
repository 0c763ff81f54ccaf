#include "compute/motion/verdict.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace palpate {
namespace {

template <class... Values>
std::string sentence(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

/// Collects findings and sorts them by how bad they are.
class Bench {
 public:
  /// A measure that must not exceed its limit. Written as !(<=), so that NaN fails.
  void at_most(double value, Limit limit, const std::string& says) {
    const Trust trust = !(value <= limit.failed)    ? Trust::kFailed
                        : !(value <= limit.suspect) ? Trust::kSuspect
                                                    : Trust::kOk;
    note(trust, says + limit_text("at most", limit, trust));
  }
  void at_least(double value, Limit limit, const std::string& says) {
    const Trust trust = !(value >= limit.failed)    ? Trust::kFailed
                        : !(value >= limit.suspect) ? Trust::kSuspect
                                                    : Trust::kOk;
    note(trust, says + limit_text("at least", limit, trust));
  }
  void note(Trust trust, std::string says) { findings_.push_back({trust, std::move(says)}); }

  Verdict verdict() {
    std::stable_sort(findings_.begin(), findings_.end(),
                     [](const Finding& a, const Finding& b) { return a.trust > b.trust; });
    Verdict result;
    for (Finding& finding : findings_) {
      result.trust = std::max(result.trust, finding.trust);
      (finding.trust == Trust::kOk ? result.passed : result.reasons)
          .push_back(std::move(finding.says));
    }
    return result;
  }

 private:
  struct Finding {
    Trust trust;
    std::string says;
  };

  static std::string limit_text(const char* side, Limit limit, Trust trust) {
    return sentence(" (%s %.4g%s).", side, trust == Trust::kFailed ? limit.failed : limit.suspect,
                    trust == Trust::kFailed ? " or the field is useless" : "");
  }

  std::vector<Finding> findings_;
};

void judge_folds(const Folds& folds, const Limits& limits, Bench& bench) {
  if (folds.not_finite > 0) {
    bench.note(Trust::kFailed,
               sentence("At %zu voxels the field is not finite (none may be).", folds.not_finite));
  }
  const double share = folds.voxels ? double(folds.folded) / double(folds.voxels) : 0.0;
  bench.at_most(share, limits.folded_share,
                sentence("%zu of %zu voxels fold, smallest determinant %.3g; the share is %.3g",
                         folds.folded, folds.voxels, folds.min_det, share));
  bench.at_most(folds.sd_log_det, limits.sd_log_det,
                sentence("Volume changes vary with an SD of log det of %.3f", folds.sd_log_det));
}

void judge_match(const Match& match, const Limits& limits, Bench& bench) {
  const double fixed = match.textured_share();
  const double moving = match.textured_share_moving();
  bench.at_least(fixed, limits.textured_share_least,
                 sentence("The share of the fixed frame that shows structure is %.4f", fixed));
  bench.at_least(moving, limits.textured_share_least,
                 sentence("The share of the moving frame that shows structure is %.4f", moving));
  const double ratio = std::max(fixed, moving) / std::max(1e-9, std::min(fixed, moving));
  bench.at_most(ratio, limits.texture_ratio,
                sentence("One frame shows %.3g times as much structure as the other", ratio));
  bench.at_least(
      match.correlation_after, limits.correlation_least,
      sentence("Where there is structure the frames agree after motion correction with a mean "
               "local correlation of %.3f (%.3f before)",
               match.correlation_after, match.correlation_before));
  bench.at_most(
      match.mismatched, limits.mismatched,
      sentence("The share of the structure that finds no match is %.3f", match.mismatched));
  const double lost = match.correlation_before - match.correlation_after;
  bench.at_most(
      lost, limits.correlation_lost,
      sentence("Motion correction changes the mean local correlation by %+.3f, a loss of %.3f",
               -lost, std::max(0.0, lost)));
  bench.at_most(match.motion_left_voxels, limits.motion_left_voxels,
                sentence("After motion correction the frames still show a motion of %.3f voxels on "
                         "average",
                         match.motion_left_voxels));
  bench.at_most(match.moving_share, limits.moving_share,
                sentence("The share of the structure that still moves by more than half a voxel "
                         "after motion correction is %.3f",
                         match.moving_share));
  bench.at_most(
      match.leaving, limits.leaving,
      sentence("The share of the structure that is carried out of the moving frame is %.3f",
               match.leaving));
}

void judge_distances(const Evidence& evidence, const Limits& limits, Bench& bench) {
  if (evidence.inverse) {
    const Spread& voxels = evidence.inverse->own_voxels;
    bench.at_most(voxels.mean, limits.inverse_mean_voxels,
                  sentence("The inverse consistency error is %.3f voxels on average", voxels.mean));
    bench.at_most(voxels.p99, limits.inverse_p99_voxels,
                  sentence("The inverse consistency error is %.3f voxels at the 99th percentile",
                           voxels.p99));
  }
  if (evidence.drift) {
    bench.at_most(
        evidence.drift->own_voxels.mean, limits.drift_mean_voxels,
        sentence("After one cycle points are %.3f voxels from where they started, on average",
                 evidence.drift->own_voxels.mean));
  }
}

/// The voxels x whose x + u(x) also lies in the mask: outside the mask the backward field is
/// unreliable.
Mask that_stays_inside(const Mask& mask, Mask voxels, const Field& u) {
  const Grid& grid = mask.grid;
  size_t offset = 0;
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i, ++offset) {
        if (!voxels.values[offset]) continue;
        const glm::dvec3 x_mm = grid.lps_from_index({i, j, k});
        const glm::ivec3 there(glm::round(grid.index_from_lps(x_mm + sample_at_lps(u, x_mm))));
        const bool inside = glm::all(glm::greaterThanEqual(there, glm::ivec3(0))) &&
                            glm::all(glm::lessThan(there, grid.size));
        voxels.values[offset] = inside && mask.values[grid.offset(there.x, there.y, there.z)];
      }
    }
  }
  return voxels;
}

}  // namespace

const char* word(Trust trust) {
  switch (trust) {
    case Trust::kOk:
      return "ok";
    case Trust::kSuspect:
      return "suspect";
    case Trust::kFailed:
      return "failed";
  }
  return "failed";
}

Verdict judged(const Evidence& evidence, const Limits& limits) {
  Bench bench;
  if (evidence.folds) judge_folds(*evidence.folds, limits, bench);
  if (evidence.match) {
    judge_match(*evidence.match, limits, bench);
  } else {
    bench.note(
        Trust::kSuspect,
        "The field was not compared with its frames, so nothing shows that it belongs to them.");
  }
  judge_distances(evidence, limits, bench);
  if (evidence.low_confidence) {
    bench.at_most(*evidence.low_confidence, limits.low_confidence,
                  sentence("The share of the structure with low confidence is %.3f",
                           *evidence.low_confidence));
  }
  return bench.verdict();
}

Verdict judged(const SequenceEvidence& evidence, const Limits& limits) {
  struct PartVerdict {
    Verdict verdict;
    std::string where;
  };
  std::vector<PartVerdict> parts;
  for (size_t k = 0; k < evidence.frames.size(); ++k) {
    const FrameEvidence& frame = evidence.frames[k];
    if (k != evidence.reference)
      parts.push_back({judged(frame.evidence, limits), "Frame " + std::to_string(k)});
    Bench between;
    judge_folds(frame.between, limits, between);
    between.at_most(frame.excursion.beyond_voxels, limits.beyond_voxels,
                    sentence("The path leaves the straight line to the next frame by up to %.3g "
                             "mm, %.3g voxels more than the frames support",
                             frame.excursion.mm, frame.excursion.beyond_voxels));
    parts.push_back({between.verdict(), "After frame " + std::to_string(k)});
  }
  if (evidence.drift) {
    Bench bench;
    judge_distances({.drift = evidence.drift}, limits, bench);
    parts.push_back({bench.verdict(), "Cycle"});
  }
  std::stable_sort(parts.begin(), parts.end(), [](const PartVerdict& a, const PartVerdict& b) {
    return a.verdict.trust > b.verdict.trust;
  });
  Verdict whole;
  // A wrong order comes first: it explains what is wrong with the frames.
  const bool all_show =
      std::all_of(evidence.frames.begin(), evidence.frames.end(), [&](const FrameEvidence& frame) {
        return !frame.evidence.match || shows_structure(frame.evidence, limits);
      });
  if (evidence.order && all_show)
    add(whole, judged(*evidence.order, evidence.ordered_by, limits), "Sequence");
  for (const PartVerdict& part : parts) add(whole, part.verdict, part.where);
  return whole;
}

bool shows_structure(const Evidence& evidence, const Limits& limits) {
  return evidence.match &&
         std::min(evidence.match->textured_share(), evidence.match->textured_share_moving()) >=
             limits.textured_share_least.suspect;
}

Verdict judged(const FrameOrder& order, const std::string& ordered_by, const Limits& limits) {
  constexpr size_t kLeastFrames = 4;  // of fewer every order is that of some movement
  const double back_mm = std::min(order.before_mm, order.after_mm);
  const bool is_noise = back_mm < limits.order_step_voxels * order.voxel_mm;
  const bool turns = order.frames > kLeastFrames && order.onward < limits.onward_least;
  if (order.frames < kLeastFrames || is_noise || !(turns || order.to_and_fro > limits.to_and_fro))
    return {};
  std::string says = sentence(
      "The path jumps to and fro: frame %zu lies %.3g and %.3g mm from the frames before and after "
      "it, which lie %.3g mm apart; check the order of the frames",
      order.frame, order.before_mm, order.after_mm, order.apart_mm);
  if (!ordered_by.empty()) says += ", now by " + ordered_by;
  return {Trust::kSuspect, {says + "."}, {}};
}

Result<Evidence> examined(const Volume& fixed, const Volume& moving, const Field& u,
                          const Field* backward, const Confidence* confidence, const Mask* mask,
                          Mask* structure) {
  Evidence evidence;
  evidence.folds = folds(u);
  Mask clear;
  const Result<Match> matched = match(fixed, moving, u, mask, &clear);
  if (!matched) return matched.error();
  evidence.match = *matched;
  // Where nothing can be seen, disagreement and low confidence are to be expected and no fault of
  // the field.
  if (backward && matched->clear > 0) {
    const Mask known = mask ? that_stays_inside(*mask, clear, u) : clear;
    const Result<Distances> inverse = inverse_consistency(u, *backward, fixed.grid, &known);
    if (inverse) evidence.inverse = *inverse;
  }
  if (confidence && matched->clear > 0) {
    const Result<double> low = low_confidence_share(*confidence, &clear);
    if (low) evidence.low_confidence = *low;
    const Result<double> radius = error_radius_mm(confidence->deviation, &clear);
    if (radius) evidence.within_95_mm = *radius;
  }
  if (structure) *structure = std::move(clear);
  return evidence;
}

void add(Verdict& whole, const Verdict& part, const std::string& where) {
  whole.trust = std::max(whole.trust, part.trust);
  for (const std::string& reason : part.reasons) whole.reasons.push_back(where + ": " + reason);
}

}  // namespace palpate
