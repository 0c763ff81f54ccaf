#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "module/calibrate/calibrate.h"
#include "module/xr/hands.h"

namespace palpate::headset {

/// Takes one touched point: both tips must be still while the button is pressed and for 0.3 s
/// after. A value; one thread.
class TouchTaker {
 public:
  /// controller_from_tip_m: the touching tip in the controller's grip.
  explicit TouchTaker(glm::dvec3 controller_from_tip_m) : tip_m_(controller_from_tip_m) {}

  struct Taken {
    std::optional<TouchedPoint> point;
    /// why no point was taken: a sentence; empty if there is nothing to report
    std::string refused;
  };
  /// Once per frame: the controller at now_s, and the samples of the device's tip since the last
  /// frame.
  Taken step(double now_s, const xr::Controller& hand, std::span<const TipSample> fresh);

 private:
  void begin(double now_s);
  Taken judge() const;

  glm::dvec3 tip_m_;
  bool pressed_ = true;  ///< a button that is already down is not a press
  std::optional<double> since_s_;
  std::vector<glm::dvec3> device_m_, stage_m_;
};

}  // namespace palpate::headset
