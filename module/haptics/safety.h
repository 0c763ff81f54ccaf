#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/cause.h"
#include "module/haptics/device.h"

namespace palpate {

/// The limits of what may reach a hand. Defaults suit a Falcon-sized device.
struct SafetyOptions {
  double max_force_n = 4.0;
  double max_slew_n_per_s =
      2000.0;  ///< of every change except towards zero after a fault, which has the ramp
  double off_ramp_s = 0.020;   ///< to zero after any cause
  double start_force_n = 0.2;  ///< start gate: the wanted force must be below this ...
  int start_frames = 3;        ///< ... for so many frames ...
  double start_ramp_s = 2.0;   ///< ... then it is let in over this time ...
  double start_damping = 0.2;  ///< ... with this share of max_damping, fading with the ramp
  double max_damping_n_s_per_m = 5.0;
  double max_speed_m_per_s = 1.5;        ///< above: damp; far above for long: off
  double edge_m = 0.004;                 ///< the force fades over this at the end of the workspace
  double first_contact_n_per_s = 200.0;  ///< slew while a contact is younger than first_contact_s
  double first_contact_s = 0.010;
  double continuous_force_n =
      0.0;  ///< thermal model: what the motors can hold for ever; 0: a third of the device's most
  double thermal_s = 60.0;          ///< its time constant
  bool dead_man = false;            ///< a button must be held
  uint32_t dead_man_buttons = ~0u;  ///< any of these
  double max_power_w =
      0.0;  ///< energy gate: power given to the hand beyond what it gave back; 0: 2 W
};

}  // namespace palpate
