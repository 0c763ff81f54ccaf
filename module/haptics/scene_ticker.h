#pragma once

#include <array>
#include <memory>

#include "module/haptics/proxy/haptics.h"
#include "module/haptics/scene/hand_commands.h"
#include "module/haptics/scene/scene_snapshot.h"
#include "module/haptics/servo/mailbox.h"

namespace palpate {

/// Haptics whose owner exchanges the scene while the servo thread runs it, to hand over new fields,
/// modes or data. The old scene is deleted by the owner, never by the servo thread. Must outlive
/// the Servo that runs it.
class SceneTicker final : public Ticker {
 public:
  SceneTicker(const HapticsOptions& options, const DeviceInfo& device)
      : haptics_(options, device) {}
  ~SceneTicker() override;
  SceneTicker(const SceneTicker&) = delete;
  SceneTicker& operator=(const SceneTicker&) = delete;

  /// Owner: the next tick runs this scene, without a step of the force (see Haptics::adopt). False
  /// if too many old scenes wait for collect(): try again a few ticks later. Allocates; one thread.
  bool offer(std::shared_ptr<const Scene> scene);
  /// Owner: deletes scenes that the loop no longer runs.
  void collect() { handover_.collect(); }

  TickOutput tick(const TickInput& input) noexcept override;

  /// Readers of the newest tick, each with a place of its own: headset, window, pictures for a
  /// page, live source, server, and stream tubes.
  static constexpr int kReaders = 7;
  /// The newest tick for a reader, 0 to kReaders - 1, each used by one thread. True if it is
  /// another than last time. Wait-free.
  bool newest(int reader, SceneSnapshot& snapshot) noexcept {
    return snapshots_[size_t(reader)].get(snapshot);
  }

  /// Owner, before the loop runs: these buttons of the device give commands.
  void take_buttons(uint32_t mask) { button_ = CommandButton(mask); }
  /// The next command of the hand, in order; false if there is none. Wait-free; one thread.
  bool next_command(HandCommand& command) noexcept { return commands_.pop(command); }

  /// The haptic step, to read options and counters; not while a Servo runs it.
  const Haptics& haptics() const { return haptics_; }

 private:
  void publish(const TickInput& input, const TickOutput& output) noexcept;

  Handover<HapticRun> handover_;
  Haptics haptics_;
  std::array<Newest<SceneSnapshot>, kReaders> snapshots_;
  CommandButton button_;
  Ring<HandCommand, 32> commands_;
};

}  // namespace palpate
