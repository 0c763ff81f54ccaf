// What the limits in verdict.h rest on. Fields are the known ones ("true") or come from ITK's fast
// symmetric-forces Demons, both directions; chest is a real CT moved by up to 15 mm with 2 % noise.
//
//                                 correlation  mismatched  leaving  inverse, voxels  SD of
//                                before after                       mean     p99     log det
//   chest, true                    .82   .96      .01       .01     .00     .01      .07
//   chest, true, gain 0.7 to 1.4   .82   .96      .01       .01     .00     .01      .07
//   chest, Demons                  .82   .96      .01       .01     .25     1.5      .08
//   chest, field of zeros          .82   .82      .10       .00      -       -       .00
//   heart phantom, true            .44   .97      .00       .00      -       -       .12
//   sliding phantom, true          .67   .93      .00       .00      -       -       .32
//   sliding phantom, Demons        .67   .76      .16       .01     .72     5.2      .22
//   chest, Demons spoilt by gain   .82   .69      .24       .03     6.4      29     1.04
//   chest against its mirror image .10 .45-.49  .47-.52   .07-.09   5-9    16-29   .58-.67
//   chest moved by 100 mm          .01 .13-.45  .51-.87   .02-.08  20-29   45-70   .55-1.3
//   chest moved by 200 mm          .01 .05-.15  .84-.95   .02-.13  22-28   59-66   .49-.68
//   chest against nothing, noise   .00   .00     1.00       .00   13-32    35-67   .00-.06
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
  /// A measure that must not exceed its limit. Written with !(<=), so that NaN fails.
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
    bench.note(Trust::kFailed, sentence("At %zu voxels the field is not a number (none may be).",
                                        folds.not_finite));
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
  bench.at_most(
      match.leaving, limits.leaving,
      sentence("The share of the structure that is carried out of the moving frame is %.3f",
               match.leaving));
}

void judge_distances(const Evidence& evidence, const Limits& limits, Bench& bench) {
  if (evidence.inverse) {
    const Spread& voxels = evidence.inverse->voxels;
    bench.at_most(
        voxels.mean, limits.inverse_mean_voxels,
        sentence("There and back misses the start by %.3f voxels on average", voxels.mean));
    bench.at_most(voxels.p99, limits.inverse_p99_voxels,
                  sentence("There and back misses the start by %.3f voxels at the 99th percentile",
                           voxels.p99));
  }
  if (evidence.drift) {
    bench.at_most(
        evidence.drift->voxels.mean, limits.drift_mean_voxels,
        sentence("After one cycle points are %.3f voxels from where they started, on average",
                 evidence.drift->voxels.mean));
  }
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

Result<Evidence> examined(const Volume& fixed, const Volume& moving, const Field& u,
                          const Field* backward, const Confidence* confidence, const Mask* mask) {
  Evidence evidence;
  evidence.folds = folds(u);
  const Result<Match> matched = match(fixed, moving, u, mask);
  if (!matched) return matched.error();
  evidence.match = *matched;
  Mask structure = textured_voxels(fixed);
  for (size_t n = 0; mask && n < structure.values.size(); ++n)
    structure.values[n] &= mask->values[n] != 0;
  const bool any =
      std::find(structure.values.begin(), structure.values.end(), 1) != structure.values.end();
  // Where nothing can be seen, disagreement and low confidence are right, and no fault of the
  // field.
  if (backward && any) {
    const Result<Distances> inverse = inverse_consistency(u, *backward, fixed.grid, &structure);
    if (inverse) evidence.inverse = *inverse;
  }
  if (confidence && any) {
    const Result<double> low = low_confidence_share(*confidence, &structure);
    if (low) evidence.low_confidence = *low;
  }
  return evidence;
}

void add(Verdict& whole, const Verdict& part, const std::string& where) {
  whole.trust = std::max(whole.trust, part.trust);
  for (const std::string& reason : part.reasons) whole.reasons.push_back(where + ": " + reason);
}

}  // namespace palpate
