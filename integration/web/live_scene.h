#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "module/haptics/scene/scene.h"
#include "module/haptics/scene/scene_snapshot.h"
#include "module/session/scene_picture.h"
#include "module/view/resident_volume.h"

namespace palpate::web {

/// The first shown volume of a scene as a browser draws it (live_view.js): its frames, its motion
/// and its look as numbered parts, and a description in JSON that names them. What `palpate view`
/// uploads to the GPU is the same; there is no part for another volume, or for segments.
///
/// A part is a list of numbers, lowest byte first. A frame is one half float a voxel (share of the
/// range of all frames, shape (nz, ny, nx)). A field is three a sample (u in voxels of the frame).
/// The look is 3 x 2048 x 4 floats: colours, integrals, next entries, as view::fill_table() makes
/// them.
class LiveScene {
 public:
  using Part = std::shared_ptr<const std::string>;

  explicit LiveScene(const ViewChoices& choices) : picture_(choices) {}

  /// Packs what is new in `scene` and forgets what is not used any more; false if nothing is new.
  /// snapshot: of a tick, for the places of the volumes. Takes up to seconds, on all cores. One
  /// thread at a time for this class.
  bool update(std::shared_ptr<const Scene> scene, const SceneSnapshot& snapshot);

  /// In JSON: "null" before the first update() and without a volume.
  const std::string& description() const { return description_; }
  /// By number.
  const std::map<uint64_t, Part>& parts() const { return parts_; }
  /// Which of the scene's volumes is drawn; -1: none.
  int volume() const { return volume_; }

  /// A volume is sent with at most this many voxels in all frames together; finer ones are reduced
  /// by means of 2 x 2 x 2.
  static constexpr double kMostVoxels = 24e6;
  /// The fields of all times together, bytes.
  static constexpr double kMostFieldBytes = 64e6;

 private:
  /// What a part was made of: the same source gives the same part.
  struct PartSource {
    std::shared_ptr<const void> owner;
    size_t index = 0;
    double low = 0.0, high = 0.0;
    auto operator<=>(const PartSource&) const = default;
  };
  /// The number of a part, which is made if there is none of this source.
  template <class Make>
  uint64_t part_of(const PartSource& source, Make make);
  /// The numbers of the frames' parts; fills in where their voxels lie, and their range.
  nlohmann::json pack_frames(const MovingVolume& volume, view::ResidentFrames& frames);
  /// The fields: one a step, or of one motion for all times one at each frame and midway to the
  /// next. null without motion.
  nlohmann::json pack_motion(const MovingVolume& volume, const view::ResidentFrames& frames);
  uint64_t pack_look(const Look& look, const view::ResidentFrames& frames);
  /// Packs and describes the first volume of what is shown.
  void pack(const ViewScene& shown, const SceneSnapshot& snapshot);

  ScenePicture picture_;
  std::shared_ptr<const Scene> scene_;
  std::string description_ = "null";
  std::map<uint64_t, Part> parts_;
  std::map<PartSource, uint64_t> numbers_, used_;  ///< by what they were made of
  uint64_t last_ = 0;
  int volume_ = -1;
};

}  // namespace palpate::web
