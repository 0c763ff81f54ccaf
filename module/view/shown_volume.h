#pragma once

#include <memory>

#include "compute/vulkan/recorder.h"
#include "module/view/resident_volume.h"
#include "module/view/view_scene.h"

namespace palpate::view {

/// What decides the values of the picture of a volume: two frames and how they are put together.
struct Moment {
  int frame = -1, next = -1;
  double phase = 0.0;
  const ResidentStep* step = nullptr;
  bool moves = false;  ///< by the step's field
  bool blend = false;
  bool operator==(const Moment&) const = default;
};

/// What the look means to the kernels: shared by all volumes, a part for each slot.
struct LookTables {
  vulkan::Buffer colours;       ///< 2 kTable: colour and extinction; their integrals
  vulkan::Buffer next_entries;  ///< kTable: the next entry with extinction
  vulkan::Buffer most;          ///< kMostLevels x kTable: most extinction of 2^level entries
};

/// The moment that a ViewVolume asks for.
Moment moment_of(const ViewVolume& volume, const ResidentVolume& resident);

/// A volume at one phase, as rays read it: values with slopes, and which bricks can show anything.
/// Brought to another phase or look by a few passes over the volume, then only read.
class ShownVolume {
 public:
  /// slot: its place in the tables and skip words that all volumes share. Throws Failure.
  ShownVolume(std::shared_ptr<vulkan::Context> context, Kernels& kernels,
              std::shared_ptr<const ResidentVolume> resident, int slot, int first_skip_word);

  static int skip_words(const ResidentVolume& resident);

  /// Records what the moment and a changed look need, and nothing if neither has changed.
  /// thin_per_mm: a brick with no more extinction may be sampled in longer steps; below 0: every
  /// brick is made, as no place will be skipped.
  void record(vulkan::Recorder& recorder, const Moment& moment, bool look_changed,
              double thin_per_mm, const LookTables& tables, const vulkan::Buffer& skip);

  const ResidentVolume& resident() const { return *resident_; }
  /// Fields that came later for the same frames.
  void set_resident(std::shared_ptr<const ResidentVolume> resident);
  const vulkan::Image& surface() const { return surface_; }
  glm::ivec3 bricks() const { return bricks_; }
  int slot() const { return slot_; }
  int first_skip_word() const { return first_skip_word_; }
  /// Counter of nodes that had to be held at the last change of phase, one word, host visible.
  vulkan::Buffer& held() { return held_; }

 private:
  glm::vec4 entries() const;
  void record_list(vulkan::Recorder& recorder, const Moment& moment, bool everything,
                   const LookTables& tables, const vulkan::Buffer& skip);
  void record_nodes(vulkan::Recorder& recorder, const Moment& moment);
  void record_bricks(vulkan::Recorder& recorder, const Moment& moment, double thin_per_mm,
                     const LookTables& tables, const vulkan::Buffer& skip);

  std::shared_ptr<vulkan::Context> context_;
  Kernels& kernels_;
  std::shared_ptr<const ResidentVolume> resident_;
  int slot_, first_skip_word_;
  glm::ivec3 size_, bricks_, node_count_;
  vulkan::Image surface_, nodes_;
  vulkan::Buffer marks_, near_, list_, list_start_, distance_[2], held_;
  Moment shown_;
  bool fresh_ = true;
};

}  // namespace palpate::view
