#pragma once

#include <glm/glm.hpp>
#include <span>

#include "module/haptics/guard/energy.h"

namespace palpate {

/// Leads from the force that the hand felt to the one that the scene gives, where the scene changes
/// it at once: the rest of the difference is added to the spring's force and decays. It owns three
/// events: a scene is exchanged, a scene is taken away, and a constraint on the hand ends or
/// changes. Such an end is the edge of a surface, a hole, a border of the data, a fold of the
/// field, or a value that is not finite. What the hand and the material do is felt at once. A tool
/// of several points has one for each, which sees the forces of a tool that is only this point.
/// Values, world; real-time safe.
class ForceBridge {
 public:
  /// What the material of a volume did in a haptic frame.
  struct MaterialStep {
    glm::dvec3 carried_m{0.0};  ///< how far it took the proxy, world
    bool is_rough = false;  ///< its motion may not be inverted there, or its point was not found
  };

  /// What the bridge reads of a haptic frame.
  struct BridgeFrame {
    glm::dvec3 spring_n{0.0};  ///< the scene's force now
    glm::dvec3 felt_n{0.0};    ///< the force of the frame before
    glm::dvec3 step_m{0.0};    ///< of the hand since then
    glm::dvec3 worked_m{0.0};  ///< of that, the part along which a force works on the hand
    double stiffness_n_per_m = 0.0;
    double dt_s = 0.0;
    double share = 1.0;  ///< of this point in the force of the tool
    std::span<const MaterialStep> materials;
  };

  /// The scene is another one: the hand felt `felt_n`, and where it is the new one gives
  /// `scene_n`.
  void exchange(glm::dvec3 felt_n, glm::dvec3 scene_n) noexcept {
    left_n_ = felt_n - scene_n;
    is_sudden_ = false;
  }
  /// There is no scene: the rest of the force, on its way to zero.
  glm::dvec3 fade(double dt_s) noexcept;
  /// What to add to the spring's force. tank pays for its work; null: its work is not limited.
  glm::dvec3 step(const BridgeFrame& frame, EnergyTank* tank) noexcept;

  /// What the last frame added, world.
  glm::dvec3 left_n() const noexcept { return left_n_; }
  /// A change by the scene is on its way to the hand.
  bool is_sudden() const noexcept { return is_sudden_; }
  /// It acted in this frame, where the motion may not be inverted.
  bool is_rough() const noexcept { return is_rough_; }

 private:
  glm::dvec3 left_n_{0.0};
  bool is_sudden_ = false;  ///< a part of it is a change that the scene made by itself
  bool is_rough_ = false;
};

}  // namespace palpate
