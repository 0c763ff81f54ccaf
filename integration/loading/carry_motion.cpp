#include "integration/loading/carry_motion.h"

#include <utility>

#include "compute/motion/estimate_sequence.h"
#include "compute/volume/memory.h"
#include "integration/files/frame_times.h"
#include "integration/files/sentences.h"

namespace palpate::loading {
namespace {

/// True if the segments were read in one frame of several.
bool has_one_segmentation(const VolumeData& data) {
  return !data.segments.empty() && data.segments.front().masks.size() == 1 &&
         data.frames.frames.size() + data.vectors.size() > 1;
}

/// Each frame's own values need a wall of each frame.
Status check_own_values(const VolumeSpec& spec, const VolumeData& data) {
  if (spec.values != CarriedValues::kOwn) return Nothing{};
  if (spec.segments.from != SegmentsFrom::kFiles)
    return files::bad_input(
        spec.files.front(),
        "is to be felt by a wall derived from one frame, which one motion carries "
        "to the others: leave 'own' out");
  if (has_one_segmentation(data))
    return files::bad_input(
        spec.segments.files.front(),
        "is the segmentation of one frame, and each frame's own values need one of each: give one "
        "per frame, or leave 'own' out");
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

}  // namespace

Result<MovingVolume> carry_motion(const VolumeSpec& spec, ReadVolume read) {
  VolumeData& data = read.data;
  if (const Status fits = check_own_values(spec, data); !fits) return fits.error();

  // A file's motion for all frames comes with just the frames that it needs, and has their times.
  if (data.whole) return build(spec, std::move(data));

  // A program's motion carries all its frames.
  const CarriedValues values = spec.values.value_or(CarriedValues::kReference);
  if (read.given && read.given->motion && values != CarriedValues::kOwn) {
    const auto own = build(spec, std::move(data));
    if (!own) return own.error();
    return carried(*own, at_pace_of(own->times, spec, *read.given->motion), values);
  }

  // Fields from frame to frame are composed to one motion for all frames if that is asked for, or
  // if the wall is known in one frame only.
  const bool of_one = has_one_segmentation(data) || spec.segments.from != SegmentsFrom::kFiles;
  const bool is_one_asked = spec.values && values != CarriedValues::kOwn;
  std::vector<Field> steps;
  if ((of_one || is_one_asked) && !data.motions.empty()) steps = data.motions.front().fields;
  auto volume = build(spec, std::move(data));
  if (!volume || steps.empty() || volume->is_still()) return volume;
  const TimeBasis times{volume->times.times_s, volume->times.cycle_s, 0};
  const size_t reference = of_one ? spec.segments.frame : frame_nearest_the_mean(steps);
  const auto whole = motion_of_steps(steps, times, reference);
  if (!whole) return whole.error();
  return carried(*volume, *whole, values);
}

bool can_carry_one_wall(const VolumeSpec& spec, const MovingVolume& volume, const Volume& frame,
                        const SequenceChoices& choices) {
  if (volume.whole || volume.is_still()) return true;
  const double bytes = double(volume.frames.size()) * double(frame.values.size()) * sizeof(float);
  return choices.finds_motion && volume.motions.empty() && spec.values != CarriedValues::kOwn &&
         check_fits_memory("One motion for the whole sequence", bytes);
}

Result<StartingVolume> start_volume(const VolumeSpec& spec, MovingVolume volume,
                                    std::function<Result<Frames>()> open_again) {
  // Segments that are known in one frame of several wait for one motion that carries them.
  if (!volume.segments.empty() && volume.frames.size() > 1 &&
      volume.segments.front().distance_mm.size() == 1) {
    auto standing = standing_at(volume, volume.segments_frame);
    if (!standing) return standing.error();
    return StartingVolume{std::make_shared<const MovingVolume>(std::move(*standing)),
                          MissingMotion{0, std::move(open_again),
                                        std::make_shared<const MovingVolume>(std::move(volume))}};
  }
  // Motion is estimated from scalars only; a flow without a given motion changes its values in
  // place. Synthetic data have theirs.
  StartingVolume starting;
  if (!volume.is_still() && volume.motions.empty() && !volume.whole && spec.source.empty() &&
      !volume.frames.front()->is_vector())
    starting.missing = MissingMotion{0, std::move(open_again), nullptr};
  starting.data = std::make_shared<const MovingVolume>(std::move(volume));
  return starting;
}

}  // namespace palpate::loading
