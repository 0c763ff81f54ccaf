#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// Detects whether consecutive frames repeat. Each frame is reduced to the means of at most 12 x 12
/// x 12 blocks, which reduces noise; d(a, b) is the RMS difference of two frames. The period is k
/// if over the last k frames n
///   m(k) = mean of d(n, n - k) <= 0.3 max of m(l), l < k,
/// at a minimum of m, for the smallest such k from 4 to kMostFrames, and if that holds for k / 4
/// frames in a row, at least three. Of a source that stands still m contains only noise at every k,
/// and it does not repeat. Frames are assumed to be evenly spaced. One thread.
class Repetition {
 public:
  static constexpr int kMostFrames = 80;

  /// Takes the newest frame; returns the period in frames if there is one.
  std::optional<int> add(const Volume& frame);
  /// The largest m up to the period that was found: how much the frames of a cycle differ.
  double contrast() const { return contrast_; }
  /// The frame of the last k (the newest is k - 1) that is most similar to the given one, and their
  /// difference.
  struct NearestFrame {
    int frame = 0;
    double distance = 0.0;
  };
  /// The present last k frames, for comparisons.
  std::vector<std::vector<float>> last(int k) const;
  static NearestFrame nearest(const Volume& frame, const std::vector<std::vector<float>>& of);
  /// The same in a cycle in which the frame is expected at `expected` (any number, not necessarily
  /// whole): of all frames that are as similar as the best one to within `as_like`, the one nearest
  /// to that. A motion to and fro shows the same twice in a cycle.
  static NearestFrame nearest(const Volume& frame, const std::vector<std::vector<float>>& of,
                              double expected, double as_like);
  void clear();

 private:
  std::deque<std::vector<float>> means_;  ///< the newest last
  /// of each frame: distance to the one k before it, at index k - 1
  std::deque<std::vector<double>> distances_;
  int found_ = 0, in_a_row_ = 0;
  double contrast_ = 0.0;
};

}  // namespace palpate
