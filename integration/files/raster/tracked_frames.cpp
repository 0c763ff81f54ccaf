#include "integration/files/raster/tracked_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "integration/files/frame_times.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

constexpr std::string_view kFramePrefix = "seq_frame";
constexpr std::string_view kTransformEnding = "transform";

/// The noise of a tracker that follows a probe at rest.
constexpr double kSamePlace_mm = 1.0;

/// Beyond the thickness of an ultrasound beam the frames show different tissue.
constexpr double kSweep_mm = 5.0;

/// The text of a field of a frame, or empty.
std::string_view frame_text(const std::map<std::string, std::string>& frame,
                            const std::string& name) {
  const auto found = frame.find(name);
  return found == frame.end() ? std::string_view{} : std::string_view(found->second);
}

/// A transform of 16 numbers, row by row; nothing if it is missing, or its status is not OK.
std::optional<glm::dmat4> transform_of(const std::map<std::string, std::string>& frame,
                                       const std::string& name) {
  const std::string status = lowered(frame_text(frame, name + "status"));
  if (!status.empty() && status != "ok") return std::nullopt;
  const auto numbers = to_numbers(frame_text(frame, name));
  if (!numbers || numbers->size() != 16) return std::nullopt;
  glm::dmat4 matrix;
  for (int n = 0; n < 16; ++n) {
    if (!std::isfinite((*numbers)[size_t(n)])) return std::nullopt;
    matrix[n % 4][n / 4] = (*numbers)[size_t(n)];
  }
  return matrix;
}

/// The transforms that say where the picture lies: "probetoreferencetransform".
struct PlaceNames {
  std::string place;
  std::string reference;  ///< to be taken off, or empty
  bool of_pixels = false;
};

std::optional<PlaceNames> place_names(const FrameFields& fields) {
  std::vector<std::string> names;
  bool has_reference = false;
  for (const auto& [frame, of_frame] : fields) {
    for (const auto& [name, text] : of_frame) {
      if (!name.ends_with(kTransformEnding)) continue;
      has_reference |= name == "referencetotrackertransform";
      for (const char* start : {"imageto", "probeto", "transducerto"})
        if (name.starts_with(start)) names.push_back(name);
    }
  }
  if (names.empty()) return std::nullopt;
  // The place in the patient's own space counts, where it is known.
  const auto of_target = [&](const char* target) {
    return std::find_if(names.begin(), names.end(), [&](const std::string& name) {
      return name.find(target) != std::string::npos;
    });
  };
  PlaceNames found;
  if (const auto direct = of_target("toreference"); direct != names.end()) {
    found.place = *direct;
  } else if (const auto tracked = of_target("totracker"); tracked != names.end()) {
    found.place = *tracked;
    if (has_reference) found.reference = "referencetotrackertransform";
  } else {
    found.place = names.front();
  }
  found.of_pixels = found.place.starts_with("image");
  return found;
}

/// How far the picture's corners move from the first frame with a known place to any other.
struct ProbePath {
  size_t known = 0;  ///< frames with a known place
  double moved_mm = 0.0;
};

ProbePath probe_path(const FrameFields& fields, const PlaceNames& names, const Raster& raster) {
  const glm::dvec3 size(raster.grid.size);
  // Transforms of an image take pixels, those of a probe mm.
  const glm::dvec3 edges = names.of_pixels ? size : size * raster.grid.spacing_mm;
  std::array<glm::dvec4, 4> first{};
  ProbePath path;
  for (size_t k = 0; k < raster.lanes; ++k) {
    const auto frame = fields.find(k);
    if (frame == fields.end()) continue;
    auto place = transform_of(frame->second, names.place);
    if (place && !names.reference.empty()) {
      const auto reference = transform_of(frame->second, names.reference);
      if (reference && glm::determinant(*reference) != 0.0)
        *place = glm::inverse(*reference) * *place;
      else
        place.reset();
    }
    if (!place) continue;
    for (int corner = 0; corner < 4; ++corner) {
      glm::dvec4 at(0.0, 0.0, 0.0, 1.0);
      if (corner > 0) at[corner - 1] = edges[corner - 1];
      at = *place * at;
      if (path.known == 0) first[size_t(corner)] = at;
      path.moved_mm = std::max(path.moved_mm, glm::length(glm::dvec3(at - first[size_t(corner)])));
    }
    ++path.known;
  }
  return path;
}

Status judge_places(const FrameFields& fields, Raster& raster) {
  const auto names = place_names(fields);
  if (!names) return Nothing{};
  const ProbePath path = probe_path(fields, *names, raster);
  if (!(path.moved_mm <= kSweep_mm)) {
    return bad_input(raster.file,
                     "was recorded with a probe that moved by up to {:.3g} mm, so that its frames "
                     "lie at different places, but frames of one sequence must share one place: "
                     "reconstruct volumes from it",
                     path.moved_mm);
  }
  if (path.moved_mm > kSamePlace_mm) {
    raster.notes.push_back(fmt::format(
        "'{}' was recorded with a probe that moved by up to {:.3g} mm: the frames are taken as if "
        "they shared one place, so its motion counts as motion of the tissue.",
        raster.file.string(), path.moved_mm));
  }
  if (path.known < raster.lanes) {
    raster.notes.push_back(fmt::format(
        "'{}' does not know the place of the probe in {} of {} frames (transform status "
        "other than OK).",
        raster.file.string(), raster.lanes - path.known, raster.lanes));
  }
  return Nothing{};
}

Status read_times(const FrameFields& fields, Raster& raster) {
  std::vector<double> times;
  for (size_t k = 0; k < raster.lanes; ++k) {
    const auto frame = fields.find(k);
    if (frame == fields.end()) break;
    const auto time = to_number(frame_text(frame->second, "timestamp"));
    if (!time) break;
    times.push_back(*time);
  }
  if (times.empty()) return Nothing{};
  if (times.size() < raster.lanes) {
    raster.notes.push_back(
        fmt::format("'{}' has no time stamp of frame {}: its times are not used.",
                    raster.file.string(), times.size()));
    return Nothing{};
  }
  if (const Status rising = check_rising(raster.file, times); !rising) return rising;
  raster.times_s = std::move(times);
  raster.times_known = true;
  return Nothing{};
}

/// The placement with its axes turned; nothing for letters that make no sense.
std::optional<Placement> turned_by(std::string_view orientation, int axes,
                                   const Placement& placement) {
  constexpr std::string_view kAlong = "MFA", kAgainst = "UND";
  if (orientation.size() < size_t(axes)) return std::nullopt;
  Placement turned = placement;
  std::array<bool, 3> used{};
  for (int a = 0; a < axes; ++a) {
    const char letter = orientation[size_t(a)];
    const bool against = kAgainst.find(letter) != std::string_view::npos;
    const size_t target = against ? kAgainst.find(letter) : kAlong.find(letter);
    if (target >= size_t(axes) || used[target]) return std::nullopt;
    used[target] = true;
    const glm::dvec3 axis = placement.axes[int(target)];
    turned.axes[a] = against ? -axis : axis;
    if (against) turned.origin_mm += axis * placement.spacing_mm[a] * (placement.size[a] - 1.0);
  }
  return turned;
}

}  // namespace

FrameFields frame_fields(const std::map<std::string, std::string>& fields) {
  FrameFields frames;
  for (const auto& [key, value] : fields) {
    const std::string name = lowered(key);
    if (!name.starts_with(kFramePrefix)) continue;
    const size_t end = name.find('_', kFramePrefix.size());
    if (end == std::string::npos) continue;
    const auto frame = to_integer(name.substr(kFramePrefix.size(), end - kFramePrefix.size()));
    if (frame && *frame >= 0) frames[size_t(*frame)][name.substr(end + 1)] = trimmed(value);
  }
  return frames;
}

Status apply_frame_fields(const FrameFields& fields, Raster& raster) {
  if (raster.lane_kind != LaneKind::kFrames || raster.lanes < 2 || fields.empty()) return Nothing{};
  for (const auto& [frame, of_frame] : fields) {
    const std::string status = lowered(frame_text(of_frame, "imagestatus"));
    if (frame < raster.lanes && !status.empty() && status != "ok") {
      return bad_input(raster.file,
                       "has no picture in frame {} (image status {}): cut the sequence so that all "
                       "its frames have one",
                       frame, frame_text(of_frame, "imagestatus"));
    }
  }
  if (const Status times = read_times(fields, raster); !times) return times;
  return judge_places(fields, raster);
}

void turn_ultrasound(std::string_view orientation, int axes, Placement& placement, Raster& raster) {
  if (orientation.empty()) return;
  if (const auto turned = turned_by(orientation, axes, placement)) {
    placement = *turned;
    return;
  }
  raster.notes.push_back(
      fmt::format("'{}' has the unknown ultrasound image orientation '{}': its axes are taken as "
                  "they are stored.",
                  raster.file.string(), orientation));
}

}  // namespace palpate::files
