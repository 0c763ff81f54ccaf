#pragma once

#include <span>
#include <string>
#include <vector>

namespace palpate::xr {

/// The rate of the display, where the runtime lets programs choose it (XR_FB_display_refresh_rate).
struct DisplayRate {
  std::vector<float> offered_hz;  ///< empty: there is nothing to choose
  double hz = 0.0;                ///< as the runtime said last; 0: it did not
  double chosen_hz = 0.0;         ///< that palpate has asked for; 0: none yet
  /// The shortest period that the pictures need, which the choice was made by, s; 0: it was made by
  /// an option.
  double needed_s = 0.0;
  std::string refused;  ///< the call that was refused; empty: none
};

/// The highest rate whose period is at least needed_s; the lowest one where all are too short.
/// offered_hz must not be empty.
double highest_rate(std::span<const float> offered_hz, double needed_s);
/// The one next to wanted_hz. offered_hz must not be empty.
double nearest_rate(std::span<const float> offered_hz, double wanted_hz);

}  // namespace palpate::xr
