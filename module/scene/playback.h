#pragma once

#include <vector>

namespace palpate {

/// Where a sequence stands: the paper's fractional frame pointer F = frame + phase. frame is the
/// data frame whose field leads to the next one; phase in [0, 1) is how much of the way is done.
struct FramePointer {
  int frame = 0;
  double phase = 0.0;
};

/// When the frames of a sequence are. Immutable.
struct FrameTimes {
  std::vector<double> times_s;  ///< of each frame, rising, the first 0; uneven steps are honoured
  double cycle_s =
      0.0;  ///< cyclic: from the first frame to the first again; 0: it ends at the last frame
  bool cyclic() const { return cycle_s > 0.0; }
  /// Fields there are: one per step to a next frame.
  int steps() const { return int(times_s.size()) - (cyclic() ? 0 : 1); }
  /// The whole length, s.
  double length_s() const { return cyclic() ? cycle_s : times_s.back(); }
};

/// Moves the frame pointer as time goes on: rate (1 = as recorded, negative = backwards, 0 =
/// paused) and scrubbing (a target to go to, at a bounded speed, so that the hand is carried and
/// not thrown). A value: copying it copies the state. Real-time safe.
class Playback {
 public:
  Playback() = default;
  explicit Playback(const FrameTimes* times) : times_(times) {}

  /// As recorded is 1. Changes act from the next step on and are ramped over 20 ms so that no
  /// velocity jumps.
  void set_rate(double rate) noexcept;
  /// Go to this time of the sequence (cyclic: the shorter way round), no faster than max_speed (s
  /// per s) of it; afterwards playing goes on at the set rate.
  void scrub_to(double time_s, double max_speed = 4.0) noexcept;

  /// Moves on by dt (s, of the haptic frame) and returns where it stands. At most one frame border
  /// is crossed per call whatever rate and dt are: what is left is done in the next calls
  /// (crossed() says which border, and the rate at which this limits is steps per haptic frame,
  /// 1,000 frames per second).
  FramePointer step(double dt_s) noexcept;

  FramePointer now() const { return pointer_; }
  /// What the last step crossed: +1 into the next frame, -1 into the one before, 0 none.
  int crossed() const { return crossed_; }
  double time_s() const { return time_s_; }
  double rate() const { return rate_; }
  /// True if it stands still and will go on standing.
  bool at_rest() const;

 private:
  const FrameTimes* times_ = nullptr;
  FramePointer pointer_;
  double time_s_ = 0.0;
  double rate_ = 1.0, wanted_rate_ = 1.0;
  double scrub_target_s_ = 0.0, scrub_speed_ = 0.0;
  bool scrubbing_ = false;
  int crossed_ = 0;
};

}  // namespace palpate
