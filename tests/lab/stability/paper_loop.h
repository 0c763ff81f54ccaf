#pragma once

#include <memory>
#include <vector>

#include "module/haptics/proxy/haptics.h"

namespace palpate::stability {

/// The paper's haptic frame, built from the same parts: transforms by its (17) to (21) and
/// back-tracking by its fixed point, both if the scene selects them. Then primitives at the proxy
/// of the last frame; one solve; and the proxy moves to the result at once. It has none of
/// palpate's additions: no sweep, no tank, no guards.
class PaperLoop {
 public:
  explicit PaperLoop(std::shared_ptr<const Scene> scene) : run_(std::move(scene)) {}
  /// Proxy and force; the command stays zero.
  TickOutput tick(const TickInput& input) noexcept;
  const HapticRun& run() const { return run_; }

 private:
  HapticRun run_;
  Placed placed_;
  bool started_ = false;
};

/// The counterpart of Hand for the paper's loop. Throws std::runtime_error if the scene can not be
/// assembled.
class PaperHand {
 public:
  PaperHand(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data);
  TickOutput to(glm::dvec3 probe_m);
  PaperLoop loop;
  TickInput input;
};

}  // namespace palpate::stability
