#include "integration/loading/read_volume_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <utility>

#include "compute/motion/estimate_sequence.h"
#include "compute/volume/memory.h"
#include "integration/files/frame_names.h"
#include "integration/files/frames.h"
#include "integration/files/read_volume.h"
#include "integration/files/segmentation.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"
#include "module/haptics/scene/scene.h"

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

Frames frames_in_memory(std::shared_ptr<const Sequence> sequence) {
  Frames frames;
  frames.name = sequence->name;
  frames.grid = sequence->frames.front().grid;
  frames.count = sequence->frames.size();
  if (sequence->times_known) frames.times_s = sequence->times_s;
  frames.in_memory = true;
  frames.read = [sequence](size_t k) -> Result<Volume> { return sequence->frames[k]; };
  return frames;
}

/// The first call returns the frames that were read and kept, if any; later calls read the files
/// again, so that the frames do not stay in memory beside their splines.
std::function<Result<Frames>()> opener_of_files(const VolumeSpec& spec,
                                                std::shared_ptr<const Sequence> kept) {
  struct Held {
    std::atomic_flag taken;
    std::shared_ptr<const Sequence> sequence;
  };
  const auto held = std::make_shared<Held>();
  held->sequence = std::move(kept);
  return [paths = spec.files, nan_as = spec.nan_as, held]() -> Result<Frames> {
    if (!held->taken.test_and_set() && held->sequence)
      return frames_in_memory(std::move(held->sequence));
    return files::open_sequence(paths, nan_as);
  };
}

bool fits_once_more(const Sequence& sequence) {
  double bytes = 0.0;
  for (const Volume& frame : sequence.frames) bytes += double(frame.values.size()) * sizeof(float);
  return bool(check_fits_memory("A sequence", bytes));
}

Volume lengths_of(const VectorFrame& frame) {
  Volume lengths{frame.grid, std::vector<float>(frame.values.size())};
  for (size_t i = 0; i < lengths.values.size(); ++i)
    lengths.values[i] = glm::length(frame.values[i]);
  return lengths;
}

/// Reads one volume, a part after the other.
class VolumeReader {
 public:
  VolumeReader(VolumeSpec& spec, const SequenceChoices& choices, const OnDoing& doing)
      : spec_(spec), choices_(choices), doing_(doing) {
    if (choices.nan_as) spec.nan_as = choices.nan_as;
    read_.given = given_for(spec.files, choices);
    read_.open_again = opener_of_files(spec, nullptr);
    is_raw_ = spec.raw.has_value() && !read_.given;
  }

  Result<ReadVolume> read() {
    Status done = holds_vectors() ? read_vectors() : read_scalars();
    if (done) done = read_steps();
    if (done) done = read_segments();
    if (!done) return done.error();
    note_unusual_place();
    return std::move(read_);
  }

 private:
  void say(const std::string& what) const {
    if (doing_) doing_(what);
  }
  template <class... Args>
  Error bad_volume(fmt::format_string<Args...> rest, Args&&... args) const {
    return files::bad_input(spec_.files.front(), rest, std::forward<Args>(args)...);
  }

  // Frames ------------------------------------------------------------------------------------

  bool holds_vectors() const {
    if (read_.given) return false;
    return is_raw_ ? spec_.raw->components == 3 : files::holds_vectors(spec_.files);
  }

  Status read_vectors() {
    auto vectors = is_raw_ ? raw_vectors() : files::read_vectors(spec_.files);
    if (!vectors) return vectors.error();
    read_.wall_frame.of_vectors = true;
    for (size_t k = 0; k < vectors->size(); ++k) read_.wall_frame.add(k, lengths_of((*vectors)[k]));
    if (!(read_.wall_frame.high > 0.0F))
      return bad_volume("holds only vectors of length 0: there is nothing to feel");
    if (spec_.values)
      return bad_volume(
          "holds vectors, which have each frame's own values: leave 'values' "
          "out");
    read_.data.vectors = std::move(*vectors);
    return Nothing{};
  }

  Result<std::vector<VectorFrame>> raw_vectors() const {
    auto vectors = files::read_raw_vectors(spec_.files.front(), *spec_.raw);
    if (!vectors) return vectors.error();
    return std::vector{std::move(*vectors)};
  }

  Status read_scalars() {
    const fs::path whole = read_.given ? fs::path() : whole_motion_of(spec_);
    const Status done = is_raw_ && whole.empty() ? read_raw()
                        : whole.empty()          ? read_frames()
                                                 : read_whole(whole);
    if (!done) return done;
    if (!(read_.wall_frame.high > read_.wall_frame.low))
      return bad_volume("holds the value {} everywhere: there is nothing to feel",
                        read_.wall_frame.low);
    return Nothing{};
  }

  /// Opens the frames that were given, or those of the files, also a single one.
  Result<Frames> open_frames() {
    if (read_.given) return frames_in_memory({read_.given, &read_.given->frames});
    auto frames = files::open_frames(spec_.files, spec_.nan_as);
    if (frames) read_.notes.insert(read_.notes.end(), frames->notes.begin(), frames->notes.end());
    return frames;
  }

  Result<Volume> read_frame(const Frames& frames, size_t k) {
    if (!frames.in_memory) say(fmt::format("reading frame {} of {}", k + 1, frames.count));
    auto frame = frames.read(k);
    if (frame) read_.wall_frame.add(k, *frame);
    return frame;
  }

  /// Reads all frames.
  Status read_all(const Frames& frames) {
    Sequence& sequence = read_.data.frames;
    sequence.name = frames.name;
    for (size_t k = 0; k < frames.count; ++k) {
      auto frame = read_frame(frames, k);
      if (!frame) return frame.error();
      sequence.frames.push_back(std::move(*frame));
    }
    sequence.times_s = frames.times_s;
    sequence.times_known = !frames.times_s.empty();
    return Nothing{};
  }

  Status read_frames() {
    if (read_.given && read_.given->motion && spec_.values != CarriedValues::kOwn)
      read_.wall_frame.number = read_.given->motion->reference;
    const auto frames = open_frames();
    if (!frames) return frames.error();
    if (const Status read = read_all(*frames); !read) return read;
    if (read_.given) {
      read_.open_again = [given = read_.given]() -> Result<Frames> {
        return frames_in_memory({given, &given->frames});
      };
      return Nothing{};
    }
    // One motion for all frames reads each frame more than once. If only steps are estimated the
    // frames are read again instead: a long sequence then takes no more memory than its splines.
    const Sequence& sequence = read_.data.frames;
    if (choices_.holds_frames && sequence.frames.size() > 1 && spec_.motions.empty() &&
        spec_.values != CarriedValues::kOwn && fits_once_more(sequence))
      read_.open_again = opener_of_files(spec_, std::make_shared<const Sequence>(sequence));
    return Nothing{};
  }

  /// Reads the volume of a file without a header.
  Status read_raw() {
    auto volume = files::read_raw_volume(spec_.files.front(), *spec_.raw);
    if (!volume) return volume.error();
    read_.wall_frame.add(0, *volume);
    read_.data.frames.name = spec_.files.front().string();
    read_.data.frames.frames.push_back(std::move(*volume));
    return Nothing{};
  }

  // Motion ------------------------------------------------------------------------------------

  /// Reads one motion for all times, and the frames that it needs: its reference frame, or all for
  /// the mean of their values. If each frame's own values are wanted, it becomes steps.
  Status read_whole(const fs::path& file) {
    if (spec_.motions.size() > 1 || spec_.motions.front().fields.size() > 1)
      return files::bad_input(file,
                              "is one motion for all of a volume and all times: name no other "
                              "beside it");
    auto motion = files::read_sequence_motion(file);
    if (!motion) return motion.error();
    const auto frames = open_frames();
    if (!frames) return frames.error();
    if (frames->count != motion->frames())
      return files::bad_input(file,
                              "is the motion of {} frames, but '{}' holds {}: name the motion "
                              "of this sequence",
                              motion->frames(), frames->name, frames->count);
    VolumeData& data = read_.data;
    if (spec_.values != CarriedValues::kOwn) read_.wall_frame.number = motion->reference;
    if (spec_.values.value_or(CarriedValues::kReference) == CarriedValues::kReference) {
      auto frame = read_frame(*frames, motion->reference);
      if (!frame) return frame.error();
      data.frames.frames.push_back(std::move(*frame));
      data.frames.times_known = !frames->times_s.empty();
      data.whole = std::move(*motion);
      return Nothing{};
    }
    if (const Status read = read_all(*frames); !read) return read;
    if (spec_.values == CarriedValues::kMean) {
      data.whole = std::move(*motion);
      return Nothing{};
    }
    data.motions.emplace_back();
    spec_.cyclic = spec_.cyclic && motion->basis.cycle_s > 0.0;
    for (size_t k = 0; k < motion->frames() - (spec_.cyclic ? 0 : 1); ++k)
      data.motions.front().fields.push_back(consecutive_field(*motion, k));
    return Nothing{};
  }

  /// Reads the motions from frame to frame, unless one motion for all frames has been read.
  Status read_steps() {
    if (read_.data.whole || !read_.data.motions.empty()) return Nothing{};
    for (const MotionSpec& motion : spec_.motions) {
      auto steps = read_motion(motion);
      if (!steps) return steps.error();
      read_.data.motions.push_back(std::move(*steps));
    }
    return Nothing{};
  }

  // Segments ----------------------------------------------------------------------------------

  /// Reads the segments of the files. If the spec names none, it gets all.
  Status read_segments() {
    SegmentsSpec& segments = spec_.segments;
    if (const Status order = files::check_listed_order(segments.files); !order) return order;
    std::vector<files::Segmentation> all;
    for (const fs::path& file : segments.files) {
      say(fmt::format("reading {}", file.filename().string()));
      auto of_file = files::read_segmentation(file);
      if (!of_file) return of_file.error();
      std::move(of_file->begin(), of_file->end(), std::back_inserter(all));
    }
    if (all.empty()) return Nothing{};
    if (segments.parts.empty()) {
      const size_t parts = all.front().parts.size();
      if (parts > size_t(kMostModes))
        return files::bad_input(
            segments.files.front(),
            "holds {} labels, and at most {} parts can be felt at once: is it an image? Of a "
            "segmentation, name the parts to feel",
            parts, kMostModes);
      for (const files::LabelledPart& part : all.front().parts) {
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
      for (const files::Segmentation& one : all) {
        auto mask = one.mask(labels);
        if (!mask) return mask.error();
        segment.masks.push_back(std::move(*mask));
      }
      segment.colour = part.colour ? glm::vec3(*part.colour) : all.front().colour(labels);
      read_.data.segments.push_back(std::move(segment));
    }
    return Nothing{};
  }

  void note_unusual_place() {
    if (read_.given) return;
    const VolumeData& data = read_.data;
    for (const std::string& unusual : files::unusual_place(
             data.vectors.empty() ? data.frames.frames.front().grid : data.vectors.front().grid))
      read_.notes.push_back(fmt::format("{}: {}", spec_.name, unusual));
  }

  VolumeSpec& spec_;
  const SequenceChoices& choices_;
  const OnDoing& doing_;
  bool is_raw_ = false;
  ReadVolume read_;
};

}  // namespace

std::shared_ptr<const GivenVolume> given_for(const std::vector<fs::path>& files,
                                             const SequenceChoices& choices) {
  if (files.size() != 1) return nullptr;
  const auto found = choices.given.find(files.front().filename().string());
  return found == choices.given.end() ? nullptr : found->second;
}

Result<ReadVolume> read_volume_data(VolumeSpec& spec, const SequenceChoices& choices,
                                    const OnDoing& doing) {
  return VolumeReader(spec, choices, doing).read();
}

}  // namespace palpate::loading
