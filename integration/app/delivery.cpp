#include "integration/app/delivery.h"

#include <fmt/format.h>

#include <algorithm>

#include "integration/app/summary.h"
#include "integration/charts/charts.h"
#include "integration/files/frames.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"

namespace palpate::app {
namespace {

/// The time to print.
double seconds_of(const SolveReport& report) {
  return report.seconds + report.prepare_seconds;
}

}  // namespace

Delivery::Delivery(DeliveryOptions options, Outputs& outputs, Console& console)
    : options_(std::move(options)), outputs_(outputs), console_(console) {}

template <class Write>
Status Delivery::put(const std::string& name, const Write& write) {
  if (name.empty()) return Nothing{};
  const auto path = outputs_.stage(name);
  if (!path) return path.error();
  if (const Status written = write(*path); !written) return outputs_.in_place(written.error());
  return Nothing{};
}

Status Delivery::take(const EstimatedPair& pair) {
  const PairMotion& motion = pair.motion;
  const Field field = options_.coarse ? motion.field : resampled(motion.field, pair.fixed->grid);
  const std::optional<Mask> mask =
      options_.mask ? std::optional(resampled(*options_.mask, field.grid)) : std::nullopt;
  Delivered now{motion.fixed_frame,
                motion.moving_frame,
                options_.names(motion.fixed_frame, motion.moving_frame),
                lengths_mm(field, mask ? &*mask : nullptr),
                motion.report,
                {}};
  if (motion.confidence.deviation.mm.empty()) now.names.deviation.clear();  // the classic engine
  if (const Status written = write(pair, field, now.names); !written) return written;
  if (options_.judge) {
    Mask structure;
    auto evidence =
        examined(*pair.fixed, *pair.moving, field, motion.backward ? &*motion.backward : nullptr,
                 &motion.confidence, options_.mask, &structure);
    if (!evidence) return evidence.error();
    now.evidence = std::move(*evidence);
    if (delivered_.empty()) {
      const Mask where = resampled(structure, field.grid);
      order_.emplace(field.grid, &where, pair.fixed->grid.finest_mm());
    }
    order_->follow(field);
    if (options_.cyclic && delivered_.empty()) {
      everywhere_.emplace(field.grid, mask ? &*mask : nullptr);
      if (now.evidence.match->clear > 0) where_structure_.emplace(pair.fixed->grid, &structure);
    }
  }
  for (auto* points : {&everywhere_, &where_structure_})
    if (*points) (*points)->follow(field);
  if (const Status drawn = draw(pair, field, now.names.picture); !drawn) return drawn;
  if (options_.page) {
    options_.page->add_frame(*pair.fixed);
    options_.page->add_step(motion.field, motion.confidence);
  }
  tell(now);
  delivered_.push_back(std::move(now));
  return Nothing{};
}

Status Delivery::write(const EstimatedPair& pair, const Field& field, const PairNames& names) {
  Status status =
      put(names.field, [&](const auto& path) { return files::write_field(field, path); });
  if (!status) return status;
  status = put(names.inverse, [&](const auto& path) {
    const Grid& onto = options_.coarse ? pair.motion.field.grid : pair.moving->grid;
    return files::write_field(inverse_of(field, onto).w, path);
  });
  if (!status) return status;
  status = put(names.confidence, [&](const auto& path) {
    return files::write_confidence(resampled(pair.motion.confidence, field.grid), path);
  });
  if (!status) return status;
  return put(names.deviation, [&](const auto& path) {
    return files::write_deviation(resampled(pair.motion.confidence.deviation, field.grid), path);
  });
}

Status Delivery::draw(const EstimatedPair& pair, const Field& field, const std::string& name) {
  return put(name, [&](const auto& path) {
    charts::PairPicture picture;
    picture.fixed = pair.fixed.get();
    picture.moving = pair.moving.get();
    picture.field = &field;
    picture.confidence = &pair.motion.confidence;
    picture.mask = options_.mask;
    const charts::Caption caption{fmt::format("Motion from frame {} to {}", pair.motion.fixed_frame,
                                              pair.motion.moving_frame),
                                  files::grid_text(pair.fixed->grid)};
    return charts::write_pair_overview(path.string(), picture, caption);
  });
}

void Delivery::tell(const Delivered& pair) {
  std::string line = fmt::format(
      "Frame {} to {}   {:.2f} s, moves {:.2f} mm on average and {:.2f} mm at most", pair.fixed,
      pair.moving, seconds_of(pair.report), pair.motion_mm.mean, pair.motion_mm.max);
  const Evidence& evidence = pair.evidence;
  if (evidence.folds) line += ", " + folds_text(*evidence.folds);
  if (evidence.match) {
    line += fmt::format(", local correlation {:.3f} -> {:.3f}", evidence.match->correlation_before,
                        evidence.match->correlation_after);
  }
  if (evidence.inverse)
    line += fmt::format(", inverse consistency {:.3f} voxel", evidence.inverse->own_voxels.mean);
  line += within_text(evidence);
  if (options_.judge) line += fmt::format(": {}", word(judged(evidence).trust));
  console_.say(line);
}

Status Delivery::close_cycle() {
  if (!everywhere_) return Nothing{};
  drift_ = CycleDrift{everywhere_->drift(), {}};
  if (where_structure_) drift_->structure = where_structure_->drift();
  delivered_.back().evidence.drift = drift_->judged();
  console_.say(cycle_text(*drift_));
  return Nothing{};
}

double Delivery::slowest_s() const {
  double slowest = 0.0;
  for (const Delivered& pair : delivered_) slowest = std::max(slowest, seconds_of(pair.report));
  return slowest;
}

Verdict Delivery::verdict() const {
  // The verdict on a single pair is printed with all checks passed.
  if (delivered_.size() == 1) return judged(delivered_.front().evidence);
  Verdict whole;
  const bool all_show =
      std::all_of(delivered_.begin(), delivered_.end(),
                  [](const Delivered& pair) { return shows_structure(pair.evidence); });
  if (order_ && all_show)
    add(whole, judged(order_->found(options_.cyclic), options_.ordered_by), "Sequence");
  for (const Delivered& pair : delivered_) {
    add(whole, judged(pair.evidence), fmt::format("Frame {} to {}", pair.fixed, pair.moving));
  }
  return whole;
}

std::vector<MotionPage::FrameCurve> Delivery::curves() const {
  std::vector<MotionPage::FrameCurve> curves = {
      {"Motion to the next frame (mm)", "mean", {}},
      {"Motion to the next frame (mm)", "95th percentile", {}}};
  for (const Delivered& pair : delivered_) {
    curves[0].y.push_back(pair.motion_mm.mean);
    curves[1].y.push_back(pair.motion_mm.p95);
  }
  return curves;
}

nlohmann::json Delivery::pairs() const {
  auto list = nlohmann::json::array();
  for (const Delivered& pair : delivered_) {
    nlohmann::json entry = {{"fixed_frame", pair.fixed},
                            {"moving_frame", pair.moving},
                            {"field", pair.names.field},
                            {"motion_mm", json_of(pair.motion_mm)},
                            {"cost", json_of(pair.report)}};
    if (!pair.names.inverse.empty()) entry["inverse"] = pair.names.inverse;
    if (!pair.names.confidence.empty()) entry["confidence"] = pair.names.confidence;
    if (!pair.names.deviation.empty()) entry["deviation"] = pair.names.deviation;
    if (!pair.names.picture.empty()) entry["picture"] = pair.names.picture;
    if (options_.judge) {
      entry["evidence"] = json_of(pair.evidence);
      entry["verdict"] = json_of(judged(pair.evidence));
    }
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace palpate::app
