#include "tests/lab/studies/reliability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "compute/motion/quality.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

// Of a bin that is drawn: fewer voxels are not significant.
constexpr double kLeastShare = 5e-3;

double ratio(double above, double below) {
  return below > 0.0 ? above / below : std::numeric_limits<double>::quiet_NaN();
}

/// Calls each(sample, error in mm) for the truth's samples inside the mask (on any grid; null:
/// all).
template <class Each>
void for_each_counted(const Field& found, const Field& truth, const Mask* mask, const Each& each) {
  const Grid& grid = truth.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        if (mask) {
          const glm::ivec3 at(glm::round(mask->grid.index_from_lps(x)));
          if (glm::any(glm::lessThan(at, glm::ivec3(0))) ||
              glm::any(glm::greaterThanEqual(at, mask->grid.size)) ||
              !mask->values[mask->grid.offset(at.x, at.y, at.z)])
            continue;
        }
        each(grid.offset(i, j, k),
             glm::distance(sample_at_lps(found, x), glm::dvec3(truth.at(i, j, k))));
      }
}

}  // namespace

void Reliability::add(double confidence, bool right, double weight) {
  const double said = confidence >= 0.0 ? std::min(1.0, confidence) : 0.0;
  Bin& bin = bins_[std::min(kBins - 1, size_t(said * double(kBins)))];
  bin.voxels += weight;
  bin.said += weight * said;
  bin.right += right ? weight : 0.0;
}

void Reliability::add_evenly(const Reliability& pair) {
  const double whole = pair.voxels();
  if (whole <= 0.0) return;
  for (size_t b = 0; b < kBins; ++b) {
    bins_[b].voxels += pair.bins_[b].voxels / whole;
    bins_[b].said += pair.bins_[b].said / whole;
    bins_[b].right += pair.bins_[b].right / whole;
  }
}

double Reliability::voxels() const {
  double sum = 0.0;
  for (const Bin& bin : bins_) sum += bin.voxels;
  return sum;
}

double Reliability::said() const {
  double sum = 0.0;
  for (const Bin& bin : bins_) sum += bin.said;
  return ratio(sum, voxels());
}

double Reliability::right() const {
  double sum = 0.0;
  for (const Bin& bin : bins_) sum += bin.right;
  return ratio(sum, voxels());
}

double Reliability::calibration_error() const {
  double sum = 0.0;
  for (const Bin& bin : bins_) sum += std::abs(bin.said - bin.right);
  return ratio(sum, voxels());
}

Reliability reliability_of(const Field& found, const Confidence& confidence, const Field& truth,
                           const Mask* mask, double right_mm) {
  const Confidence trust = resampled(confidence, truth.grid);
  Reliability result;
  for_each_counted(found, truth, mask, [&](size_t sample, double off_mm) {
    result.add(trust.values[sample], off_mm <= right_mm);
  });
  return result;
}

Radii radii_of(const Field& found, const Deviation& deviation, const Field& truth, const Mask& mask,
               double voxel_mm) {
  const Deviation sd = resampled(deviation, truth.grid);
  std::vector<double> errors;
  double own = 0.0;
  for_each_counted(found, truth, &mask, [&](size_t sample, double off_mm) {
    errors.push_back(off_mm);
    own += off_mm <= error_radius_mm(glm::dvec2(sd.mm[sample])) ? 1.0 : 0.0;
  });
  const auto said = error_radius_mm(deviation, &mask);
  if (!said || errors.empty()) throw Mismatch("No voxel counts, so there is no radius");
  std::sort(errors.begin(), errors.end());
  const auto count = double(errors.size());
  const auto within = std::upper_bound(errors.begin(), errors.end(), *said) - errors.begin();
  return {*said / voxel_mm, errors[size_t(0.95 * (count - 1.0))] / voxel_mm, double(within) / count,
          own / count};
}

report::Table radii_table(const std::vector<std::pair<std::string, Radii>>& all,
                          const std::string& title) {
  report::Table table;
  table.title = title;
  table.note =
      "The radius within which 95 % of the voxels should be right, by the deviation, beside the "
      "95th percentile of the error, voxels of the finest axis; the share of the voxels that is "
      "within it, and within a radius of its own for each voxel.";
  table.columns = {{"pair", "pair"},
                   {"radius_voxels", "radius"},
                   {"truth_voxels", "95th percentile"},
                   {"inside", "within it"},
                   {"inside_own", "within its own"}};
  for (const auto& [name, radii] : all)
    table.rows.push_back({report::words(name), report::number(radii.said, 3),
                          report::number(radii.truth, 3), report::number(radii.inside, 3),
                          report::number(radii.inside_own, 3)});
  return table;
}

report::Table reliability_table(const std::vector<NamedReliability>& all,
                                const std::string& title) {
  report::Table table;
  table.title = title;
  table.note = fmt::format(
      "Right: within {} voxel of the finest axis. Of voxels with confidence c a share of c should "
      "be right; the calibration error is by how much that is missed, on average. Each bin of "
      "confidence: share of the voxels / share of them that is right.",
      kRightVoxels);
  table.columns = {{"pair", "pair"},
                   {"confidence", "mean confidence"},
                   {"right", "right"},
                   {"calibration_error", "calibration error"}};
  for (size_t b = 0; b < Reliability::kBins; ++b) {
    const std::string from = fmt::format("{:.1f}", double(b) / double(Reliability::kBins));
    table.columns.push_back({"bin_" + from, from + "-"});
  }
  for (const auto& [name, reliability] : all) {
    std::vector<report::Cell> row = {report::words(name), report::number(reliability.said(), 3),
                                     report::number(reliability.right(), 3),
                                     report::number(reliability.calibration_error(), 3)};
    for (const Reliability::Bin& bin : reliability.bins())
      row.push_back(bin.voxels > 0.0 ? report::words(fmt::format("{:.3f}/{:.2f}",
                                                                 bin.voxels / reliability.voxels(),
                                                                 bin.right / bin.voxels))
                                     : report::nothing());
    table.rows.push_back(std::move(row));
  }
  return table;
}

report::Chart reliability_chart(const std::vector<NamedReliability>& all,
                                const std::string& title) {
  report::Chart chart;
  chart.title = title;
  chart.x = {"Confidence, mean of its bin", false, 0.0, 1.0};
  chart.y = {fmt::format("Share within {} voxel of the truth", kRightVoxels), false, 0.0, 1.0};
  chart.series.push_back({"perfectly calibrated",
                          {{0.0, 0.0}, {1.0, 1.0}},
                          report::Line::kDashed,
                          report::Mark::kNone,
                          6});
  for (const auto& [name, reliability] : all) {
    report::Series series{fmt::format("{} (off by {:.3f})", name, reliability.calibration_error()),
                          {},
                          report::Line::kStraight,
                          {},
                          {}};
    for (const Reliability::Bin& bin : reliability.bins()) {
      const double share = ratio(bin.voxels, reliability.voxels());
      if (!(share >= kLeastShare)) continue;
      series.points.push_back(
          {bin.said / bin.voxels, bin.right / bin.voxels, "", false,
           fmt::format("{:.1f} % of the voxels: confidence {:.2f}, right {:.2f}", 100.0 * share,
                       bin.said / bin.voxels, bin.right / bin.voxels)});
    }
    chart.series.push_back(std::move(series));
  }
  chart.width_px = 880;
  chart.height_px = 480;
  return chart;
}

}  // namespace palpate::studies
