#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "integration/loading/load_scene.h"
#include "integration/loading/read_volume_data.h"

namespace palpate::loading {

/// The volume that is felt and seen, moved by what was read of its motion. All forms of it end here
/// in one MovingVolume: fields from frame to frame stay its motions; one motion for all frames, of
/// a file, of a program, or composed of the fields where the spec needs one, is its `whole`.
/// Without any its frames are there alone. kBadInput with one sentence. Uses all cores.
Result<MovingVolume> carry_motion(const VolumeSpec& spec, ReadVolume read);

/// True if the volume has one motion for all its frames, needs none, or can wait for one.
bool can_carry_one_wall(const VolumeSpec& spec, const MovingVolume& volume, const Volume& frame,
                        const SequenceChoices& choices);

/// A volume as it starts.
struct StartingVolume {
  std::shared_ptr<const MovingVolume> data;
  /// its motion is still to be found; its `volume` is not said yet
  std::optional<MissingMotion> missing;
};

/// The volume until its motion is found, if it lacks one: it plays frame by frame, or stands still
/// as the one frame in which its segments are known. open_again: see ReadVolume.
Result<StartingVolume> start_volume(const VolumeSpec& spec, MovingVolume volume,
                                    std::function<Result<Frames>()> open_again);

}  // namespace palpate::loading
