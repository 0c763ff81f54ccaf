#pragma once

#include "module/view/eye.h"

namespace palpate {

/// How pictures are kept within their time.
struct ResolutionOptions {
  double budget_s = 1.0 / 90.0;  ///< for one picture of all eyes
  double least = 0.4;            ///< of the full width and height
};

/// Which share of the full width and height the next picture has. A value: copying it copies the
/// state.
struct Resolution {
  double scale = 1.0;   ///< what the next picture is drawn at
  double full_s = 0.0;  ///< what a picture of full size would take, smoothed; 0: not known yet
  bool moving = false;  ///< on its way to another scale
};

/// The next state after a picture drawn at now.scale took frame_s. A pure function.
///
/// Time is assumed to be proportional to the number of pixels. The scale starts to move only when a
/// picture would take more than 95 % or less than 65 % of the budget, and then goes to where it
/// takes 80 %: so it stands still where times scatter by some 15 %. It never snaps: by at most 3 %
/// of itself a picture downwards and 1 % upwards. A time that is not above 0 and finite changes
/// nothing.
Resolution next_resolution(const Resolution& now, double frame_s, const ResolutionOptions& options);

/// The picture's size at a scale: even numbers, at least 16.
PictureSize scaled(PictureSize full, double scale);

}  // namespace palpate
