#include "integration/app/delivery.h"

#include <fmt/format.h>

#include <algorithm>

#include "integration/app/summary.h"
#include "integration/charts/charts.h"
#include "integration/files/write_field.h"
#include "integration/files/write_volume.h"

namespace palpate::app {
namespace {

Confidence on_grid(const Confidence& confidence, const Grid& onto) {
  Volume values = resampled(Volume{confidence.grid, confidence.values}, onto);
  return {onto, std::move(values.values)};
}

/// The voxels of the fixed frame in which motion can be seen, inside the mask if there is one; no
/// mask at all if that leaves nothing.
std::optional<Mask> structure_of(const Volume& fixed, const Mask* mask) {
  Mask structure = textured_voxels(fixed);
  for (size_t n = 0; mask && n < structure.values.size(); ++n)
    structure.values[n] &= uint8_t(mask->values[n] != 0);
  const bool any =
      std::find(structure.values.begin(), structure.values.end(), 1) != structure.values.end();
  return any ? std::optional(std::move(structure)) : std::nullopt;
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
  Delivered now{motion.fixed_frame,
                motion.moving_frame,
                options_.names(motion.fixed_frame, motion.moving_frame),
                lengths_mm(field),
                motion.report,
                {}};
  if (const Status written = write(pair, field, now.names); !written) return written;
  if (options_.judge) {
    auto evidence =
        examined(*pair.fixed, *pair.moving, field, motion.backward ? &*motion.backward : nullptr,
                 &motion.confidence, options_.mask);
    if (!evidence) return evidence.error();
    now.evidence = std::move(*evidence);
  }
  if (const Status drawn = draw(pair, field, now.names.picture); !drawn) return drawn;
  if (options_.judge && options_.cyclic) {
    if (delivered_.empty()) structure_ = structure_of(*pair.fixed, options_.mask);
    fields_.push_back(motion.field);
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
  return put(names.confidence, [&](const auto& path) {
    return files::write_confidence(on_grid(pair.motion.confidence, field.grid), path);
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
                                  grid_text(pair.fixed->grid)};
    return charts::write_pair_overview(path.string(), picture, caption);
  });
}

void Delivery::tell(const Delivered& pair) {
  std::string line =
      fmt::format("Frame {} to {}   {:.2f} s, moves {:.2f} mm on average and {:.2f} mm at most",
                  pair.fixed, pair.moving, pair.report.seconds + pair.report.prepare_seconds,
                  pair.motion_mm.mean, pair.motion_mm.max);
  const Evidence& evidence = pair.evidence;
  if (evidence.folds) line += ", " + folds_text(*evidence.folds);
  if (evidence.match) {
    line += fmt::format(", local correlation {:.3f} -> {:.3f}", evidence.match->correlation_before,
                        evidence.match->correlation_after);
  }
  if (evidence.inverse)
    line += fmt::format(", there and back {:.3f} voxel", evidence.inverse->voxels.mean);
  if (options_.judge) line += fmt::format(": {}", word(judged(evidence).trust));
  console_.say(line);
}

Status Delivery::close_cycle() {
  if (!options_.cyclic || fields_.empty() || !structure_) return Nothing{};
  auto drift = cycle_drift(fields_, structure_->grid, &*structure_);
  if (!drift) return drift.error();
  drift_ = *drift;
  if (!delivered_.empty()) delivered_.back().evidence.drift = drift_;
  console_.say(
      fmt::format("Cycle     points end {:.3f} mm ({:.3f} voxel) from where they started, "
                  "95 % within {:.3f} mm",
                  drift_->mm.mean, drift_->voxels.mean, drift_->mm.p95));
  return Nothing{};
}

Verdict Delivery::verdict() const {
  // One pair speaks for itself, with all that was found good.
  if (delivered_.size() == 1) return judged(delivered_.front().evidence);
  Verdict whole;
  for (const Delivered& pair : delivered_) {
    add(whole, judged(pair.evidence), fmt::format("Frame {} to {}", pair.fixed, pair.moving));
  }
  return whole;
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
