#include "integration/app/sequence_output.h"

#include <fmt/format.h>

#include "compute/volume/memory.h"
#include "integration/app/summary.h"
#include "integration/charts/charts.h"
#include "integration/files/raster/raster.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/sequence_motion_file.h"

namespace palpate::app {
namespace {

/// Stages a file and writes it; an error names the final path.
template <class Write>
Status put(Outputs& outputs, const std::string& name, const Write& write) {
  if (name.empty()) return Nothing{};
  const auto path = outputs.stage(name);
  if (!path) return path.error();
  const Status written = write(*path);
  return written ? written : Status(outputs.in_place(written.error()));
}

}  // namespace

Result<std::vector<Volume>> all_frames(Frames& frames, std::stop_token stop) {
  const double bytes = double(frames.count) * double(frames.grid.count()) * sizeof(float);
  const Status fits = check_fits_memory("One motion for the whole sequence", bytes);
  if (!fits)
    return Error{fits.error().kind,
                 fits.error().message + ", or find the motion from frame to frame only"};
  std::vector<Volume> kept;
  for (size_t k = 0; k < frames.count && !stop.stop_requested(); ++k) {
    auto frame = frames.read(k);
    if (!frame) return frame.error();
    kept.push_back(std::move(*frame));
  }
  return kept;
}

std::string reference_field_name(const std::string& format, size_t frame, size_t count) {
  return fmt::format("reference_to_{:0{}}.{}", frame, std::to_string(count - 1).size(), format);
}

Result<Written> write_sequence(const SequenceMotion& motion, const std::vector<Volume>& frames,
                               const std::vector<Confidence>& step_confidence,
                               const SequenceOutputOptions& options, Outputs& outputs) {
  const size_t count = motion.frames();
  Status status = put(outputs, files::kSequenceMotionName,
                      [&](const auto& path) { return files::write_sequence_motion(motion, path); });
  const Grid& image = frames.front().grid;
  const bool cyclic = motion.basis.cycle_s > 0.0;
  const Grid& onto = options.coarse ? motion.terms.front().grid : image;
  CyclePoints points(image, options.mask);
  nlohmann::json written = {{"file", files::kSequenceMotionName},
                            {"reference_frame", motion.reference},
                            {"harmonics", motion.basis.harmonics},
                            {"cycle_s", motion.basis.cycle_s}};
  for (size_t k = 0; status && k < count; ++k) {
    const std::string name = reference_field_name(options.format, k, count);
    written["reference_fields"].push_back(name);
    status = put(outputs, name, [&](const auto& path) {
      const Field field = motion.at_frame(k);
      return files::write_field(options.coarse ? field : resampled(field, onto), path);
    });
  }
  const size_t steps = count - (cyclic ? 0 : 1);
  for (size_t k = 0; status && k < steps; ++k) {
    const size_t next = (k + 1) % count;
    PairNames names = options.names(k, next);
    if (step_confidence[k].deviation.mm.empty()) names.deviation.clear();  // the classic engine
    const Field field = consecutive_field(motion, k, onto);
    points.follow(field);
    written["fields"].push_back(names.field);
    status = put(outputs, names.field,
                 [&](const auto& path) { return files::write_field(field, path); });
    if (!status) break;
    status = put(outputs, names.inverse, [&](const auto& path) {
      return files::write_field(inverse_of(field, field.grid).w, path);
    });
    if (!status) break;
    status = put(outputs, names.confidence, [&](const auto& path) {
      return files::write_confidence(resampled(step_confidence[k], field.grid), path);
    });
    if (!status) break;
    status = put(outputs, names.deviation, [&](const auto& path) {
      return files::write_deviation(resampled(step_confidence[k].deviation, field.grid), path);
    });
    if (!status) break;
    status = put(outputs, names.picture, [&](const auto& path) {
      charts::PairPicture picture;
      picture.fixed = &frames[k];
      picture.moving = &frames[next];
      picture.field = &field;
      picture.confidence = &step_confidence[k];
      picture.mask = options.mask;
      const charts::Caption caption{fmt::format("Motion from frame {} to {}", k, next),
                                    files::grid_text(frames[k].grid)};
      return charts::write_pair_overview(path.string(), picture, caption);
    });
  }
  if (!status) return status.error();
  Written result{std::move(written), {}};
  if (cyclic) result.drift = points.drift();
  return result;
}

}  // namespace palpate::app
