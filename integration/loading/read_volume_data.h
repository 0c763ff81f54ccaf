#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/frames.h"
#include "integration/loading/choose_wall.h"
#include "integration/loading/load_scene.h"
#include "module/scene/make_volume.h"

namespace palpate::loading {

/// What files, or a program in place of them, hold of a volume.
struct ReadVolume {
  VolumeData data;
  std::shared_ptr<const GivenVolume> given;  ///< the program's frames; null: files
  WallFrame wall_frame;
  /// Opens the frames again, of which motion is estimated: they can not be recovered from their
  /// splines. Any thread.
  std::function<Result<Frames>()> open_again;
  std::vector<std::string> notes;  ///< on the files, a sentence each
};

/// The frames that a program has given in place of these files; null: they are files.
std::shared_ptr<const GivenVolume> given_for(const std::vector<std::filesystem::path>& files,
                                             const SequenceChoices& choices);

/// Reads what a volume without a source consists of: its frames (scalars or vectors), the fields
/// between them or the one motion for all of them, and its segments. The spec gets what is decided
/// by reading: nan_as, its segments' parts where it names none, and that a motion has no cycle.
/// kBadInput with one sentence. Any thread.
Result<ReadVolume> read_volume_data(VolumeSpec& spec, const SequenceChoices& choices,
                                    const OnDoing& doing);

}  // namespace palpate::loading
