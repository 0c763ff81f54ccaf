#pragma once

#include <memory>
#include <optional>

#include "compute/vulkan/recorder.h"
#include "module/view/resident_volume.h"
#include "module/view/view_scene.h"

namespace palpate::view {

/// What the values of a volume in a picture depend on: two frames and how they are blended; or,
/// where one motion carries one frame at all times, the time.
struct ShownFrames {
  int frame = -1, next = -1;
  double phase = 0.0;
  const ResidentStep* step = nullptr;
  bool moves = false;  ///< by the step's field, or by the motion of the whole sequence
  bool blend = false;
  const ResidentTerms* whole = nullptr;
  /// With `whole`, on the way to it: the motion from which it comes, and the share of `whole`.
  const ResidentTerms* whole_before = nullptr;
  double whole_share = 1.0;
  int whole_frame = 0;       ///< with `whole`: the time is this frame's,
  double whole_phase = 0.0;  ///< and this share of the way to the next one
  bool operator==(const ShownFrames&) const = default;
};

/// The looks as tables for the kernels: shared by all volumes, a part for each slot.
struct LookTables {
  vulkan::Buffer colours;       ///< 2 kTable: colour and extinction; their integrals
  vulkan::Buffer next_entries;  ///< kTable: the next entry with extinction
  vulkan::Buffer most;          ///< kMostLevels x kTable: most extinction of 2^level entries
};

/// The frames that a ViewVolume asks for.
ShownFrames shown_frames_of(const ViewVolume& volume, const ResidentVolume& resident);

/// A volume at one phase, as rays read it: values with slopes, and which bricks can show anything.
/// Brought to another phase or look by a few passes over the volume, then only read.
class ShownVolume {
 public:
  /// slot: its place in the tables and skip words that all volumes share. Throws as vulkan::Buffer
  /// does.
  ShownVolume(std::shared_ptr<vulkan::Context> context, Kernels& kernels,
              std::shared_ptr<const ResidentVolume> resident, int slot, int first_skip_word);

  static int skip_words(const ResidentVolume& resident);

  /// Records the passes that changed frames or a changed look need; nothing if neither has changed.
  /// Returns whether anything was recorded.
  /// thin_per_mm: bricks with no more extinction than this may be sampled in longer steps; below 0:
  /// every brick is computed, since none will be skipped. long_steps: of more than half a brick.
  bool record(vulkan::Recorder& recorder, const ShownFrames& frames, bool look_changed,
              double thin_per_mm, bool long_steps, const LookTables& tables,
              const vulkan::Buffer& skip);

  const ResidentVolume& resident() const { return *resident_; }
  /// Sets fields that were found later for the same frames.
  void set_resident(std::shared_ptr<const ResidentVolume> resident);
  const vulkan::Image& surface() const { return surface_; }
  glm::ivec3 bricks() const { return bricks_; }
  int slot() const { return slot_; }
  int first_skip_word() const { return first_skip_word_; }
  /// Counter of nodes that were frozen at the last change of phase, one word, host visible.
  vulkan::Buffer& frozen() { return frozen_; }

 private:
  glm::vec4 entries() const;
  void record_list(vulkan::Recorder& recorder, const ShownFrames& frames, bool everything,
                   bool long_steps, const LookTables& tables, const vulkan::Buffer& skip);
  void record_motion(vulkan::Recorder& recorder, const ShownFrames& frames);
  /// A motion of a whole sequence at one time, with buffer and image for it.
  struct MotionAt {
    vulkan::Buffer weights;
    vulkan::Image u;
  };
  void record_motion_at(vulkan::Recorder& recorder, const ResidentTerms& terms,
                        const TimeWeights& time, MotionAt& at);
  void record_nodes(vulkan::Recorder& recorder, const ShownFrames& frames);
  void record_bricks(vulkan::Recorder& recorder, const ShownFrames& frames, double thin_per_mm,
                     const LookTables& tables, const vulkan::Buffer& skip);

  std::shared_ptr<vulkan::Context> context_;
  Kernels& kernels_;
  std::shared_ptr<const ResidentVolume> resident_;
  int slot_, first_skip_word_;
  glm::ivec3 size_, bricks_, node_count_;
  vulkan::Image surface_, nodes_;
  MotionAt motion_;  ///< with `whole`: at the time that is shown
  /// On the way from one motion to another: both at that time, and their blend.
  struct OnTheWay {
    MotionAt before;
    vulkan::Image blended;
  };
  std::optional<OnTheWay> on_the_way_;
  /// With `whole`: what moves the picture.
  const vulkan::Image& shown_motion() const {
    return on_the_way_ ? on_the_way_->blended : motion_.u;
  }
  vulkan::Buffer marks_, near_, list_, list_start_, distance_[2], frozen_;
  ShownFrames shown_;
  bool fresh_ = true;
};

}  // namespace palpate::view
