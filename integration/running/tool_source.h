#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "integration/openigtlink/client.h"
#include "module/haptics/servo/background.h"
#include "module/haptics/servo/position_source.h"
#include "module/scene/transform.h"
#include "module/session/loaded_scene.h"

namespace palpate::running {

/// Options of a probe moved by a tracked tool: a hand in the world, at its true size, without
/// force. Trackers send about ten positions a second, so it follows as slowly as a mouse.
PositionSourceOptions tool_probe();

/// Makes the hand's space the world around the middle of the first volume, for a hand at true size.
void stand_in_true_size(LoadedScene& scene);

/// A tracked tool as the hand: TRANSFORMs of an OpenIGTLink server give its tip, in the patient
/// space (LPS, mm) of the first volume as placed at the start. It gives no force.
class ToolSource {
 public:
  /// tool: device name of its transforms; empty: that of the first ones received. on_note: called
  /// with a sentence, on any thread. Errors: kBadInput: no valid address, or no such host.
  static Result<std::unique_ptr<ToolSource>> open(const std::string& address,
                                                  const std::string& tool,
                                                  std::function<void(const std::string&)> on_note);
  ~ToolSource();
  ToolSource(const ToolSource&) = delete;
  ToolSource& operator=(const ToolSource&) = delete;

  /// From now on moves `probe` (borrowed until end()) in the scene as placed at its start; call it
  /// after stand_in_true_size(). If no transform arrives for kSilence_ns, or the tool moves faster
  /// than kFastest_m_per_s, the hand lets go; the next transform takes it again.
  void begin(PositionSource& probe, const SceneSpec& spec);
  void end();
  static constexpr int64_t kSilence_ns = 300'000'000;
  static constexpr double kFastest_m_per_s = 3.0;

  /// For the summary; after end().
  std::string summary() const;

 private:
  ToolSource() = default;
  void take(const openigtlink::Rigid& rigid);
  void move(PositionSource& probe);

  mutable std::mutex mutex_;
  glm::dvec3 tip_lps_mm_{0.0};  ///< the last one
  int64_t heard_ns_ = 0;        ///< 0: none yet
  bool jumped_ = false;         ///< since the last move()
  uint64_t jumps_ = 0;
  openigtlink::ClientNumbers numbers_;
  Transform world_from_volume_, world_from_device_;
  std::unique_ptr<Background> moves_;
  std::unique_ptr<openigtlink::Client> client_;
};

}  // namespace palpate::running
