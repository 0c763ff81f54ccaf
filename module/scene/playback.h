#pragma once

#include <vector>

namespace palpate {

/// The phase of a sequence: the paper's fractional frame pointer F = frame + phase. frame is the
/// data frame whose field leads to the next one; phase in [0, 1) is the share of the way that is
/// done. A sequence that is not cyclic ends in its last frame with phase 0, where no field starts.
struct FramePointer {
  int frame = 0;
  double phase = 0.0;
  bool operator==(const FramePointer&) const = default;
};

/// When the frames of a sequence are. Immutable.
struct FrameTimes {
  std::vector<double> times_s;  ///< of each frame, rising, the first 0; uneven steps are honoured
  /// cyclic: from the first frame to the first again; 0: it ends at the last frame
  double cycle_s = 0.0;
  bool assumed = false;  ///< nobody knows the times: see assumed_times()
  bool cyclic() const { return cycle_s > 0.0; }
  /// How many fields there are: one per step to a next frame.
  int steps() const { return int(times_s.size()) - (cyclic() ? 0 : 1); }
  /// The whole length, s.
  double length_s() const { return cyclic() ? cycle_s : times_s.back(); }
};

/// The frame pointer at a time of the sequence, s: beyond its ends it wraps (cyclic) or stays at
/// them. For viewers, which predict the time at which a picture is displayed. NaN: the start. Any
/// thread.
FramePointer pointer_at(const FrameTimes& times, double time_s) noexcept;

/// Moves the frame pointer as time goes on: rate (1 = as recorded, negative = backwards, 0 =
/// paused) and scrubbing (a target to go to, at a bounded speed, so that the hand is not thrown). A
/// value: copying it copies the state. Real-time safe.
///
/// The time of the sequence is kept in two doubles, so that ten million steps add up to the sum of
/// what was asked for (tested to 1e-9 s). The velocity has no jumps: changes of rate are ramped
/// over 20 ms, and a scrub's target and the ends of a sequence that is not cyclic are approached
/// slower and slower over about as long.
class Playback {
 public:
  Playback() = default;
  /// `times` must outlive it; null or a single frame stands still.
  explicit Playback(const FrameTimes* times) : times_(times) {}

  /// Continues at the same time with other frame times, such as those of an exchanged volume.
  /// `times` must outlive it.
  void set_times(const FrameTimes* times) noexcept;

  /// As recorded is 1. Changes act from the next step on and are ramped over 20 ms so that no
  /// velocity jumps. 0 also drops what is left over from earlier steps. Not finite: ignored.
  void set_rate(double rate) noexcept;
  /// Go to this time of the sequence (cyclic: the shorter way round), no faster than max_speed (s
  /// per s) of it; afterwards playing goes on at the set rate. Not finite, or a speed of 0 or less:
  /// ignored.
  void scrub_to(double time_s, double max_speed = 4.0) noexcept;

  /// Moves on by dt (s, of the haptic frame) and returns the frame pointer. At most one frame
  /// border is crossed per call, whatever rate and dt are; the rest of the way is done in the next
  /// calls. At 1 kHz this limits playing to 1,000 frames per second. crossed() says which border it
  /// was. A dt that is not above 0 moves nothing.
  FramePointer step(double dt_s) noexcept;

  FramePointer now() const { return pointer_; }
  /// What the last step crossed: +1 into the next frame, -1 into the one before, 0 none.
  int crossed() const { return crossed_; }
  /// Of the sequence: 0 to its length.
  double time_s() const { return time_s_; }
  /// The velocity now, s per s: ramps and ends included.
  double rate() const { return rate_; }
  /// True if it stands still and will go on standing.
  bool at_rest() const;

 private:
  bool is_single() const;
  double start_of(int frame) const;
  double end_of(int frame) const;
  double to_target() const;
  double to_end(double direction) const;
  double advance_rate(double dt_s);
  void start_ramp();
  void move(double way_s);
  void set_phase();

  const FrameTimes* times_ = nullptr;
  FramePointer pointer_;
  double time_s_ = 0.0, time_low_s_ = 0.0;  ///< their sum is the time
  double owed_s_ = 0.0;                     ///< asked for, not done yet: see step()
  double rate_ = 1.0, wanted_rate_ = 1.0;
  double ramp_per_s_ = 0.0;  ///< how fast the rate goes to what is wanted
  double scrub_target_s_ = 0.0, scrub_speed_ = 0.0;
  bool scrubbing_ = false;
  int crossed_ = 0;
};

}  // namespace palpate
