#include "integration/loading/load_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "compute/motion/estimate_sequence.h"
#include "compute/volume/heart_phantom.h"
#include "compute/volume/memory.h"
#include "integration/files/frame_names.h"
#include "integration/files/frame_times.h"
#include "integration/files/frames.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/files/scene/scene_file.h"
#include "integration/files/segmentation.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"
#include "integration/loading/mode_library.h"
#include "integration/x3d/x3d_file.h"
#include "module/haptics/scene/scene.h"
#include "module/scene/built_in.h"
#include "module/scene/derived_wall.h"
#include "module/scene/make_volume.h"
#include "module/scene/wall_value.h"

namespace palpate::loading {
namespace {

namespace fs = std::filesystem;

/// The fields that a path stands for: the file itself, or in a folder the files motion_* in the
/// order of their frames (palpate motion pads the numbers), or all its images if there are none
/// with this name.
Result<std::vector<fs::path>> files_of(const std::vector<fs::path>& paths, const char* prefix) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::path& path : paths) {
    if (!fs::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    std::vector<fs::path> named, all;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      if (!files::has_image_ending(entry.path())) continue;
      all.push_back(entry.path());
      if (entry.path().filename().string().starts_with(prefix)) named.push_back(entry.path());
    }
    std::vector<fs::path>& found = named.empty() ? all : named;
    if (found.empty())
      return files::bad_input(path, "holds no fields: name the folder that palpate motion filled");
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

/// What is needed to choose the surface: a copy of the first frame (for vectors their lengths), and
/// the range of values in all frames. Also the frames from which motion will be estimated.
struct FirstFrame {
  Volume first;
  /// null: the fields are given, or the frames will be read again
  std::shared_ptr<const Sequence> all;
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();

  void add(const Volume& frame) {
    if (frame.values.empty()) return;
    const auto [least, most] = std::minmax_element(frame.values.begin(), frame.values.end());
    low = std::min(low, *least);
    high = std::max(high, *most);
    if (first.values.empty()) first = frame;
  }
};

/// The file with one motion for all times that a path names: the file itself, or the one in a
/// folder that palpate motion has written. Empty if there is none.
fs::path whole_motion_of(const VolumeSpec& spec) {
  for (const MotionSpec& motion : spec.motions)
    for (const fs::path& path : motion.fields) {
      std::error_code error;
      const fs::path file =
          fs::is_directory(path, error) ? path / files::kSequenceMotionName : path;
      if (files::holds_sequence_motion(file)) return file;
    }
  return {};
}

Result<MotionData> read_motion(const MotionSpec& spec) {
  MotionData motion;
  const auto fields = files_of(spec.fields, "motion_");
  if (!fields) return fields.error();
  for (const fs::path& file : *fields) {
    auto field = files::read_field(file);
    if (!field) return field.error();
    motion.fields.push_back(std::move(*field));
  }
  const auto confidences = files_of(spec.confidences, "confidence_");
  if (!confidences) return confidences.error();
  for (const fs::path& file : *confidences) {
    auto volume = files::read_volume(file);
    if (!volume) return volume.error();
    motion.confidences.push_back({volume->grid, std::move(volume->values)});
  }
  return motion;
}

/// The frames that a program has given in place of these files; null: they are files.
std::shared_ptr<const GivenVolume> given_for(const std::vector<fs::path>& files,
                                             const SequenceChoices& choices) {
  if (files.size() != 1) return nullptr;
  const auto found = choices.given.find(files.front().filename().string());
  return found == choices.given.end() ? nullptr : found->second;
}

Result<Frames> frames_in_memory(std::shared_ptr<const Sequence> sequence) {
  Frames frames;
  frames.name = sequence->name;
  frames.grid = sequence->frames.front().grid;
  frames.count = sequence->frames.size();
  if (sequence->times_known) frames.times_s = sequence->times_s;
  frames.in_memory = true;
  frames.read = [sequence](size_t k) -> Result<Volume> { return sequence->frames[k]; };
  return frames;
}

/// Returns a function that opens the frames again. Its first call returns the frames that were read
/// and kept; later calls read the files again, so that the frames do not stay in memory beside
/// their splines.
std::function<Result<Frames>()> opener(const VolumeSpec& spec, const SequenceChoices& choices,
                                       std::shared_ptr<const Sequence> of_files) {
  if (const auto given = given_for(spec.files, choices))
    return [given] { return frames_in_memory({given, &given->frames}); };
  struct Held {
    std::atomic_flag taken;
    std::shared_ptr<const Sequence> sequence;
  };
  const auto held = std::make_shared<Held>();
  held->sequence = std::move(of_files);
  return [paths = spec.files, nan_as = spec.nan_as, held] {
    if (!held->taken.test_and_set() && held->sequence)
      return frames_in_memory(std::move(held->sequence));
    return files::open_sequence(paths, nan_as);
  };
}

/// Reads all frames of files, also a single one.
Result<Sequence> read_frames(const VolumeSpec& spec, const SequenceChoices& choices,
                             FirstFrame& samples, const OnDoing& doing,
                             std::vector<std::string>& notes) {
  if (const auto given = given_for(spec.files, choices)) {
    for (const Volume& frame : given->frames.frames) samples.add(frame);
    return given->frames;
  }
  auto reader = files::SequenceReader::open(spec.files, spec.nan_as);
  if (!reader) return reader.error();
  notes.insert(notes.end(), reader->notes().begin(), reader->notes().end());
  Sequence sequence;
  sequence.name = reader->name();
  for (size_t k = 0; k < reader->frame_count(); ++k) {
    if (doing) doing(fmt::format("reading frame {} of {}", k + 1, reader->frame_count()));
    auto frame = reader->frame(k);
    if (!frame) return frame.error();
    samples.add(*frame);
    sequence.frames.push_back(std::move(*frame));
  }
  sequence.times_known = reader->times_known();
  if (sequence.times_known) sequence.times_s = reader->times_s();
  return sequence;
}

bool fits_once_more(const Sequence& sequence) {
  double bytes = 0.0;
  for (const Volume& frame : sequence.frames) bytes += double(frame.values.size()) * sizeof(float);
  return bool(check_fits_memory("A sequence", bytes));
}

/// Reads the volume of a file without a header.
Result<Sequence> raw_frames(const VolumeSpec& spec, FirstFrame& samples) {
  auto volume = files::read_raw_volume(spec.files.front(), *spec.raw);
  if (!volume) return volume.error();
  samples.add(*volume);
  Sequence sequence;
  sequence.name = spec.files.front().string();
  sequence.frames.push_back(std::move(*volume));
  return sequence;
}

Result<std::vector<VectorFrame>> raw_vectors(const VolumeSpec& spec) {
  auto vectors = files::read_raw_vectors(spec.files.front(), *spec.raw);
  if (!vectors) return vectors.error();
  return std::vector{std::move(*vectors)};
}

/// Reads the reference frame, which the motion carries to all times; of the other frames only the
/// mean is used. If each frame's own values are wanted, all frames and the fields between them.
Status read_whole(const fs::path& file, VolumeSpec& spec, const SequenceChoices& choices,
                  VolumeData& data, FirstFrame& samples, const OnDoing& doing,
                  std::vector<std::string>& notes) {
  if (spec.motions.size() > 1 || spec.motions.front().fields.size() > 1)
    return files::bad_input(file,
                            "is one motion for all of a volume and all times: name no other beside "
                            "it");
  auto motion = files::read_sequence_motion(file);
  if (!motion) return motion.error();
  auto reader = files::SequenceReader::open(spec.files, spec.nan_as);
  if (!reader) return reader.error();
  if (reader->frame_count() != motion->frames())
    return files::bad_input(file,
                            "is the motion of {} frames, but '{}' holds {}: name the motion "
                            "of this sequence",
                            motion->frames(), reader->name(), reader->frame_count());
  if (spec.values.value_or(CarriedValues::kReference) != CarriedValues::kReference) {
    auto frames = read_frames(spec, choices, samples, doing, notes);
    if (!frames) return frames.error();
    data.frames = std::move(*frames);
    if (spec.values == CarriedValues::kMean) {
      data.whole = std::move(*motion);
      return Nothing{};
    }
    data.motions.emplace_back();
    spec.cyclic = spec.cyclic && motion->basis.cycle_s > 0.0;
    for (size_t k = 0; k < motion->frames() - (spec.cyclic ? 0 : 1); ++k)
      data.motions.front().fields.push_back(consecutive_field(*motion, k));
    return Nothing{};
  }
  notes.insert(notes.end(), reader->notes().begin(), reader->notes().end());
  if (doing)
    doing(fmt::format("reading frame {} of {}", motion->reference + 1, reader->frame_count()));
  auto frame = reader->frame(motion->reference);
  if (!frame) return frame.error();
  samples.add(*frame);
  data.frames.frames.push_back(std::move(*frame));
  data.frames.times_known = reader->times_known();
  data.whole = std::move(*motion);
  return Nothing{};
}

/// True if the segments were read in one frame of several.
bool has_one_segmentation(const VolumeData& data) {
  return !data.segments.empty() && data.segments.front().masks.size() == 1 &&
         data.frames.frames.size() + data.vectors.size() > 1;
}

Volume lengths_of(const VectorFrame& frame) {
  Volume lengths{frame.grid, std::vector<float>(frame.values.size())};
  for (size_t i = 0; i < lengths.values.size(); ++i)
    lengths.values[i] = glm::length(frame.values[i]);
  return lengths;
}

/// Reads the segments of the files. If the spec names none, it gets all.
Status read_segments(VolumeSpec& spec, VolumeData& data, const OnDoing& doing) {
  SegmentsSpec& segments = spec.segments;
  if (const Status order = files::check_listed_order(segments.files); !order) return order;
  std::vector<files::Segmentation> read;
  for (const fs::path& file : segments.files) {
    if (doing) doing(fmt::format("reading {}", file.filename().string()));
    auto of_file = files::read_segmentation(file);
    if (!of_file) return of_file.error();
    std::move(of_file->begin(), of_file->end(), std::back_inserter(read));
  }
  if (read.empty()) return Nothing{};
  if (segments.parts.empty()) {
    const size_t parts = read.front().parts.size();
    if (parts > size_t(kMostModes))
      return files::bad_input(
          segments.files.front(),
          "holds {} labels, and at most {} parts can be felt at once: is it an image? Of a "
          "segmentation, name the parts to feel",
          parts, kMostModes);
    for (const files::LabelledPart& part : read.front().parts) {
      segments.parts.emplace_back();
      segments.parts.back().name = part.name;
    }
  }
  for (const SegmentSpec& part : segments.parts) {
    const std::vector<std::string> labels =
        part.labels.empty() ? std::vector<std::string>{part.name} : part.labels;
    SegmentData segment;
    segment.name = part.name;
    segment.shown = part.shown;
    for (const files::Segmentation& one : read) {
      auto mask = one.mask(labels);
      if (!mask) return mask.error();
      segment.masks.push_back(std::move(*mask));
    }
    segment.colour = part.colour ? glm::vec3(*part.colour) : read.front().colour(labels);
    data.segments.push_back(std::move(segment));
  }
  return Nothing{};
}

/// A given motion at the pace that is asked for, or at that of its frames where neither they nor it
/// have times.
SequenceMotion at_pace_of(const FrameTimes& times, const VolumeSpec& spec, SequenceMotion motion) {
  std::vector<double>& own_s = motion.basis.times_s;
  const bool is_asked = spec.frames_per_second > 0.0 || spec.cycle_s > 0.0;
  const bool has_none = times.assumed && own_s == files::counted_times(own_s.size());
  if (own_s.size() != times.times_s.size() || own_s.size() < 2 || !(is_asked || has_none))
    return motion;
  const double factor = times.times_s.back() / own_s.back();
  for (double& time_s : own_s) time_s *= factor;
  motion.basis.cycle_s *= factor;
  return motion;
}

Result<MovingVolume> read_volume_of(VolumeSpec& spec, const SequenceChoices& choices,
                                    FirstFrame& samples, const OnDoing& doing,
                                    std::vector<std::string>& notes) {
  if (doing) doing("preparing " + spec.name);
  if (!spec.source.empty()) return build(spec);
  if (choices.nan_as) spec.nan_as = choices.nan_as;
  VolumeData data;
  const auto given = given_for(spec.files, choices);
  const bool is_raw = spec.raw.has_value() && !given;
  if (!given && (is_raw ? spec.raw->components == 3 : files::holds_vectors(spec.files))) {
    auto vectors = is_raw ? raw_vectors(spec) : files::read_vectors(spec.files);
    if (!vectors) return vectors.error();
    for (const VectorFrame& frame : *vectors) samples.add(lengths_of(frame));
    if (!(samples.high > 0.0F))
      return files::bad_input(spec.files.front(),
                              "holds only vectors of length 0: there is nothing to feel");
    if (spec.values)
      return files::bad_input(spec.files.front(),
                              "holds vectors, which have each frame's own values: leave 'values' "
                              "out");
    data.vectors = std::move(*vectors);
  } else {
    if (const fs::path whole = whole_motion_of(spec); !whole.empty() && !given) {
      const Status read = read_whole(whole, spec, choices, data, samples, doing, notes);
      if (!read) return read.error();
    } else {
      auto frames =
          is_raw ? raw_frames(spec, samples) : read_frames(spec, choices, samples, doing, notes);
      if (!frames) return frames.error();
      // One motion for all frames reads each frame more than once. If only steps are estimated the
      // frames are read again instead: a long sequence then takes no more memory than its splines.
      if (!given && choices.holds_frames && frames->frames.size() > 1 && spec.motions.empty() &&
          spec.values != CarriedValues::kOwn && fits_once_more(*frames))
        samples.all = std::make_shared<const Sequence>(*frames);
      data.frames = std::move(*frames);
    }
    if (!(samples.high > samples.low))
      return files::bad_input(spec.files.front(),
                              "holds the value {} everywhere: there is nothing to feel",
                              samples.low);
  }
  if (!data.whole && data.motions.empty())
    for (const MotionSpec& motion : spec.motions) {
      auto read = read_motion(motion);
      if (!read) return read.error();
      data.motions.push_back(std::move(*read));
    }
  if (const Status segments = read_segments(spec, data, doing); !segments) return segments.error();
  if (doing) doing("preparing " + spec.name);
  if (!given)
    for (const std::string& unusual : files::unusual_place(
             data.vectors.empty() ? data.frames.frames.front().grid : data.vectors.front().grid))
      notes.push_back(fmt::format("{}: {}", spec.name, unusual));
  if (data.whole) return build(spec, std::move(data));
  if (given && given->motion && spec.values != CarriedValues::kOwn) {
    const auto own = build(spec, std::move(data));
    if (!own) return own.error();
    return carried(*own, at_pace_of(own->times, spec, *given->motion),
                   spec.values.value_or(CarriedValues::kReference));
  }
  // Consecutive fields are composed to one motion for all frames if that is asked for, or if the
  // segments are known in one frame only.
  const bool is_derived = spec.segments.from != SegmentsFrom::kFiles;
  const bool of_one = has_one_segmentation(data) || (is_derived && !data.motions.empty());
  if (is_derived && spec.values == CarriedValues::kOwn)
    return files::bad_input(
        spec.files.front(),
        "is to be felt by a wall derived from one frame, which one motion carries "
        "to the others: leave 'own' out");
  if (of_one && spec.values == CarriedValues::kOwn)
    return files::bad_input(
        spec.segments.files.front(),
        "is the segmentation of one frame, and each frame's own values need one of each: give one "
        "per frame, or leave 'own' out");
  std::vector<Field> steps;
  if ((of_one || (spec.values && spec.values != CarriedValues::kOwn)) && !data.motions.empty())
    steps = data.motions.front().fields;
  auto volume = build(spec, std::move(data));
  if (!volume || steps.empty() || volume->is_still()) return volume;
  const TimeBasis times{volume->times.times_s, volume->times.cycle_s, 0};
  const size_t reference = of_one ? spec.segments.frame : frame_nearest_the_mean(steps);
  const auto whole = motion_of_steps(steps, times, reference);
  return whole ? carried(*volume, *whole, spec.values.value_or(CarriedValues::kReference))
               : whole.error();
}

/// True if the segments are known in one frame of several, so that only one motion for all frames
/// carries them to the others.
bool waits_for_motion(const MovingVolume& volume) {
  return !volume.segments.empty() && volume.frames.size() > 1 &&
         volume.segments.front().distance_mm.size() == 1;
}

/// Adds a volume with its data, at its place.
Status add(LoadedScene& scene, size_t v, const SequenceChoices& choices, const FirstFrame& samples,
           MovingVolume volume) {
  VolumeSpec& spec = scene.spec.volumes[v];
  const auto start = start_transform(spec, volume);
  if (!start) return start.error();
  if (spec.box_m && spec.source.empty() && filled_box(spec, volume) != *spec.box_m) {
    const glm::dvec3 box = filled_box(spec, volume);
    scene.notes.push_back(fmt::format(
        "The grid of {} lies obliquely and keeps its proportions: its box is {:.4g} x {:.4g} x "
        "{:.4g} m ({}).",
        spec.name, box.x, box.y, box.z,
        spec.box_assumed ? std::string("the scene gives no dimensions")
                         : fmt::format("the scene gives {:.4g} x {:.4g} x {:.4g} m", spec.box_m->x,
                                       spec.box_m->y, spec.box_m->z)));
  }
  spec.transform = *start;
  spec.centred = false;
  if (spec.source.empty()) spec.box_m.reset();
  if (waits_for_motion(volume)) {
    auto standing = standing_at(volume, volume.segments_frame);
    if (!standing) return standing.error();
    scene.notes.push_back(
        fmt::format("The {} is that of frame {}: {} stands still there until one motion for all "
                    "frames is known.",
                    spec.segments.from == SegmentsFrom::kFiles ? "segmentation" : "wall",
                    volume.segments_frame, spec.name));
    scene.missing.push_back({v, opener(spec, choices, samples.all),
                             std::make_shared<const MovingVolume>(std::move(volume))});
    scene.data.push_back(std::make_shared<const MovingVolume>(std::move(*standing)));
    return Nothing{};
  }
  // Motion is estimated from scalars only; a flow without a given motion changes its values in
  // place.
  const bool vectors = volume.frames.front()->is_vector();
  if (!volume.is_still() && volume.motions.empty() && !volume.whole && spec.source.empty() &&
      !vectors)
    scene.missing.push_back({v, opener(spec, choices, samples.all), nullptr});
  scene.data.push_back(std::make_shared<const MovingVolume>(std::move(volume)));
  return Nothing{};
}

/// A wall derived from the values of a frame becomes the volume's only segment.
Status add_derived_wall(VolumeSpec& spec, MovingVolume& volume, const Volume& frame,
                        std::vector<std::string>& notes) {
  SegmentsSpec& segments = spec.segments;
  const bool ridges = segments.from == SegmentsFrom::kRidges;
  std::optional<DerivedWall> wall =
      ridges ? ridge_wall(frame, segments.iso_value, segments.smooth_mm)
             : region_wall(frame, segments.iso_value, segments.smooth_mm);
  if (!wall)
    return files::bad_input(
        spec.files.front(),
        "has nothing large enough that is brighter than {:.4g} and has a border: choose another "
        "iso-value, or the wall 'values'",
        segments.iso_value.value_or(wall_of(frame).at.iso_value));
  const SegmentSpec& part = segments.parts.front();
  const glm::vec3 colour = part.colour ? glm::vec3(*part.colour) : glm::vec3(0.85F, 0.55F, 0.5F);
  notes.push_back(fmt::format(
      "The wall to feel is derived from the values: {}, in frame {} smoothed by {:.2g} mm. A hand "
      "that strokes it "
      "comes to an end at {:.0f} % of its places.",
      ridges ? "where the values rise most steeply"
             : fmt::format("the border of what is brighter than {:.4g}", wall->iso_value),
      volume.whole ? volume.whole->reference() : 0, wall->smooth_mm, 100.0 * wall->ends));
  volume.segments.push_back(
      {part.name, colour, {sampled_scalar(std::move(wall->distance_mm))}, part.shown});
  return Nothing{};
}

/// True if the volume can wait for one motion for all its frames, or needs none.
bool can_carry_one_wall(const VolumeSpec& spec, const MovingVolume& volume, const Volume& frame,
                        const SequenceChoices& choices) {
  if (volume.whole || volume.is_still()) return true;
  const double bytes = double(volume.frames.size()) * double(frame.values.size()) * sizeof(float);
  return choices.finds_motion && volume.motions.empty() && spec.values != CarriedValues::kOwn &&
         check_fits_memory("One motion for the whole sequence", bytes);
}

/// How well the iso-value that is asked for, or the best one, serves as a wall.
WallQuality values_as_wall(const Volume& frame, const SequenceChoices& choices) {
  return choices.iso_value
             ? wall_quality(frame, {*choices.iso_value, value_between_groups(frame).width})
             : wall_of(frame);
}

Result<ModeSpec> surface_of(const fs::path& file, const FirstFrame& samples,
                            const WallQuality& found, const SequenceChoices& choices,
                            std::vector<std::string>& notes) {
  const double iso_value = found.at.iso_value;
  if (!(iso_value >= samples.low && iso_value <= samples.high))
    return files::bad_input(
        file, "has values from {:.6g} to {:.6g}: there is no surface at the iso-value {:.6g}",
        samples.low, samples.high, iso_value);
  auto strength = TransferFunction::window(iso_value, choices.width.value_or(found.at.width),
                                           choices.strength_n);
  if (!strength) return strength.error();
  if (!choices.iso_value)
    notes.push_back(
        fmt::format("The surface to feel is put at {:.4g}, between the two main groups of values: "
                    "an iso-value says otherwise.",
                    iso_value));
  if (found.ends > kClosedWall)
    notes.push_back(fmt::format(
        "This surface is no closed wall: at {:.0f} % of its places it ends within {:.2g} mm "
        "or has a hole there, and a hand that strokes it falls through; feel a segmentation "
        "instead, or a wall derived from the values (the wall 'region').",
        100.0 * found.ends, found.aside_mm));
  else
    notes.push_back(
        fmt::format("A hand that strokes this surface comes to its end or to a hole within {:.2g} "
                    "mm at {:.0f} % of its places.",
                    found.aside_mm, 100.0 * found.ends));
  ModeSpec surface;
  surface.name = "surface";
  surface.strength = *strength;
  surface.friction = TransferFunction::constant(choices.friction);
  return surface;
}

/// Vectors guide the hand along them. The strength rises with their length and is full at the
/// longest.
Result<ModeSpec> guide_along(const Volume& lengths, const SequenceChoices& choices,
                             std::vector<std::string>& notes) {
  const double longest = lengths.values.empty()
                             ? 0.0
                             : *std::max_element(lengths.values.begin(), lengths.values.end());
  const double iso_value = choices.iso_value.value_or(0.5 * longest);
  const double width = choices.width.value_or(choices.iso_value ? 0.0 : longest);
  auto strength = TransferFunction::window(iso_value, width, choices.strength_n);
  if (!strength) return strength.error();
  if (!choices.iso_value)
    notes.push_back(fmt::format(
        "These are vectors: the hand is guided along them, with full force at a length of {:.4g}; "
        "an iso-value and a width say otherwise, and a scene file offers other modes.",
        longest));
  ModeSpec follow;
  follow.name = "along";
  follow.kind = "follow";
  follow.strength = *strength;
  return follow;
}

/// Adds a mode or segment to a volume for which none was chosen: guides along vectors, a surface of
/// the values, or a wall derived from them.
Status feel_usual(LoadedScene& scene, VolumeSpec& spec, MovingVolume& volume,
                  const FirstFrame& samples, const SequenceChoices& choices) {
  const bool asks_for_derived =
      choices.wall == FeltWall::kRegion || choices.wall == FeltWall::kRidges;
  if (volume.frames.front()->is_vector()) {
    if (asks_for_derived)
      return files::bad_input(
          spec.files.front(),
          "holds vectors, and walls are derived from scalars: leave the wall out");
    auto guide = guide_along(samples.first, choices, scene.notes);
    if (!guide) return guide.error();
    guide->volume = spec.name;
    scene.spec.modes.push_back(std::move(*guide));
    return Nothing{};
  }
  const WallQuality values = values_as_wall(samples.first, choices);
  FeltWall wall = choices.wall;
  if (wall == FeltWall::kUsual)
    wall = values.ends > kClosedWall && !choices.iso_value && !choices.width &&
                   can_carry_one_wall(spec, volume, samples.first, choices)
               ? FeltWall::kRegion
               : FeltWall::kValues;
  if (wall == FeltWall::kRegion || wall == FeltWall::kRidges) {
    SegmentsSpec derived;
    derived.from = wall == FeltWall::kRidges ? SegmentsFrom::kRidges : SegmentsFrom::kRegion;
    derived.iso_value = choices.iso_value;
    SegmentSpec part;
    part.name = "wall";
    part.strength_n = choices.strength_n;
    part.friction = choices.friction;
    derived.parts = {part};
    const SegmentsSpec none = std::exchange(spec.segments, derived);
    std::vector<std::string> notes;
    if (choices.wall == FeltWall::kUsual)
      notes.push_back(
          fmt::format("The iso-surface is no closed wall: at {:.0f} % of its places it ends within "
                      "{:.2g} mm or has a hole. (The wall 'values' is this surface all the same.)",
                      100.0 * values.ends, values.aside_mm));
    const Status added = add_derived_wall(spec, volume, samples.first, notes);
    if (added) scene.notes.insert(scene.notes.end(), notes.begin(), notes.end());
    if (added || choices.wall != FeltWall::kUsual) return added;
    spec.segments = none;  // no other can be derived from these data
  }
  std::vector<std::string> unsaid;
  auto surface = surface_of(spec.files.front(), samples, values, choices,
                            wall == FeltWall::kNotFelt ? unsaid : scene.notes);
  if (!surface) return surface.error();
  surface->volume = spec.name;
  scene.spec.modes.push_back(std::move(*surface));
  return Nothing{};
}

/// A scene without modes gets for each volume the same as a sequence without a scene file.
Result<LoadedScene> of_spec(std::string name, SceneSpec spec, const SequenceChoices& choices,
                            const OnDoing& doing, std::vector<std::string> notes = {}) {
  LoadedScene scene;
  scene.name = std::move(name);
  scene.spec = std::move(spec);
  scene.notes = std::move(notes);
  const bool without_modes = scene.spec.modes.empty();
  for (size_t v = 0; v < scene.spec.volumes.size(); ++v) {
    FirstFrame samples;
    auto volume = read_volume_of(scene.spec.volumes[v], choices, samples, doing, scene.notes);
    if (!volume) return volume.error();
    VolumeSpec& of = scene.spec.volumes[v];
    if (of.segments.from != SegmentsFrom::kFiles) {
      const Status derived = add_derived_wall(of, *volume, samples.first, scene.notes);
      if (!derived) return derived.error();
    } else if (without_modes && !samples.first.values.empty() &&
               (volume->segments.empty() || choices.iso_value)) {
      const size_t before = scene.spec.modes.size();
      const Status felt = feel_usual(scene, of, *volume, samples, choices);
      if (!felt) return felt.error();
      if (v > 0 && scene.spec.modes.size() > before)
        scene.spec.modes.back().name += fmt::format(" of {}", of.name);
    }
    if (const Status added = add(scene, v, choices, samples, std::move(*volume)); !added)
      return added.error();
  }
  return scene;
}

Result<LoadedScene> of_sequence(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                                const OnDoing& doing) {
  LoadedScene scene;
  scene.name = inputs.front().string();
  scene.from_sequence = true;
  VolumeSpec spec;
  spec.name = files::sequence_name(inputs);
  spec.files = inputs;
  spec.frames_per_second = choices.frames_per_second;
  spec.cyclic = choices.cyclic;
  if (!choices.fields.empty()) {
    MotionSpec motion;
    motion.fields = {choices.fields};
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(choices.fields, error))
      if (entry.path().filename().string().starts_with("confidence_"))
        motion.confidences = {choices.fields};
    spec.motions = {motion};
  }
  spec.values = choices.values;
  spec.segments.files = choices.segments;
  spec.segments.frame = choices.segments_frame;
  for (const std::string& name : choices.segment_names) {
    spec.segments.parts.emplace_back();
    spec.segments.parts.back().name = name;
  }
  // A derived wall is known in one frame, like a single segmentation.
  if (choices.wall == FeltWall::kRegion) spec.segments.from = SegmentsFrom::kRegion;
  if (choices.wall == FeltWall::kRidges) spec.segments.from = SegmentsFrom::kRidges;
  FirstFrame samples;
  auto volume = read_volume_of(spec, choices, samples, doing, scene.notes);
  if (!volume) return volume.error();
  for (SegmentSpec& segment : spec.segments.parts) {
    segment.strength_n = choices.strength_n;
    segment.friction = choices.friction;
  }
  // With segments their walls are felt; the values only if that is asked for.
  if (volume->segments.empty() || choices.iso_value) {
    const Status felt = feel_usual(scene, spec, *volume, samples, choices);
    if (!felt) return felt.error();
  }
  scene.spec.volumes = {spec};
  if (const Status added = add(scene, 0, choices, samples, std::move(*volume)); !added)
    return added.error();
  return scene;
}

/// Loads a scene from text; `read` parses it with the known kinds of mode.
template <class Read>
Result<LoadedScene> of_words(const std::string& name, const SequenceChoices& choices,
                             const OnDoing& doing, const Read& read) {
  auto kinds = load_modes(choices.mode_libraries);
  if (!kinds) return kinds.error();
  Result<SceneSpec> spec = read(added_kinds(*kinds));
  if (!spec) return spec.error();
  if (choices.values)
    for (VolumeSpec& volume : spec->volumes)
      if (volume.source.empty()) volume.values = choices.values;
  auto scene = of_spec(name, std::move(*spec), choices, doing);
  if (scene) scene->kinds = std::move(*kinds);
  return scene;
}

}  // namespace

Result<LoadedScene> load_scene_text(const std::string& text, const SequenceChoices& choices,
                                    const OnDoing& doing) {
  return of_words("scene", choices, doing, [&](const std::vector<std::string>& more_kinds) {
    return files::parse_scene("scene", text, more_kinds, nullptr, choices.folder);
  });
}

Result<LoadedScene> load_scene(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                               const OnDoing& doing) {
  const std::string name = inputs.front().string();
  const bool is_scene = inputs.size() == 1 && inputs.front().extension() == ".json";
  if (!choices.mode_libraries.empty() && !is_scene)
    return Error{
        ErrorKind::kBadInput,
        "Libraries of haptic modes are for a scene file, which names the modes: give one (.json)"};
  // Frames given by a program may have any name, also that of synthetic data.
  if (given_for(inputs, choices)) return of_sequence(inputs, choices, doing);
  using SyntheticScene = std::pair<const char*, SceneSpec (*)()>;
  for (const auto& [made, scene] :
       {SyntheticScene{"heart", heart_scene}, SyntheticScene{"shell", shell_scene},
        SyntheticScene{"molecule", molecule_scene}}) {
    if (inputs.size() != 1 || name != made) continue;
    if (choices.values)
      return Error{
          ErrorKind::kBadInput,
          fmt::format("'{}' is synthetic data, which have their own values at all times: leave "
                      "the choice of values out",
                      name)};
    return of_spec(name, scene(), choices, doing);
  }
  if (is_scene)
    return of_words(name, choices, doing, [&](const std::vector<std::string>& more_kinds) {
      return files::read_scene(inputs.front(), more_kinds, choices.folder);
    });
  if (inputs.size() == 1 && x3d::is_x3d(inputs.front())) {
    auto read = x3d::read_x3d(inputs.front(), choices.folder);
    if (!read) return read.error();
    if (choices.values)
      for (VolumeSpec& volume : read->spec.volumes)
        if (volume.source.empty()) volume.values = choices.values;
    return of_spec(name, std::move(read->spec), choices, doing, std::move(read->notes));
  }
  return of_sequence(inputs, choices, doing);
}

namespace {

Result<LoadedScene> shown_scene(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                                const OnDoing& doing) {
  const auto vectors = std::count_if(inputs.begin(), inputs.end(), [](const fs::path& input) {
    return files::holds_vectors({input});
  });
  const bool alike = vectors == 0 ? bool(files::SequenceReader::open(inputs))
                                  : vectors == std::ptrdiff_t(inputs.size());
  if (inputs.size() == 1 || alike) return load_scene(inputs, choices, doing);
  LoadedScene all;
  for (const fs::path& input : inputs) {
    auto one = load_scene({input}, choices, doing);
    if (!one) return one.error();
    if (all.data.empty()) {
      all = std::move(*one);
      continue;
    }
    for (size_t v = 0; v < one->data.size(); ++v) {
      VolumeSpec volume = one->spec.volumes[v];
      volume.name += fmt::format(" ({})", all.data.size() + 1);
      // The middle of a file's data is placed at the origin: here that of the first file.
      if (!volume.files.empty()) volume.transform = all.spec.volumes.front().transform;
      all.spec.volumes.push_back(std::move(volume));
      all.data.push_back(one->data[v]);
    }
  }
  return all;
}

}  // namespace

Result<LoadedScene> load_shown_scene(const std::vector<fs::path>& inputs,
                                     const SequenceChoices& choices, const OnDoing& doing) {
  auto scene = shown_scene(inputs, choices, doing);
  if (scene && !scene->missing.empty() && choices.values && choices.values != CarriedValues::kOwn)
    return files::bad_input(inputs.front(),
                            "has no motion yet that could carry values: run 'palpate motion' and "
                            "name its output as the fields, or leave the choice of values out");
  return scene;
}

}  // namespace palpate::loading
