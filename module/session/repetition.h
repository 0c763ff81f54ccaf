#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// Finds out whether frames that come one after the other repeat. Each is reduced to the means of
/// at most 12 x 12 x 12 blocks, in which noise goes down; d(a, b) is the RMS difference of two
/// such. Frames repeat after k of them if over the last k frames n
///   m(k) = mean of d(n, n - k) <= 0.3 max of m(l), l < k,
/// at a minimum of m, for the smallest such k from 4 to kMostFrames, and so for k / 4 frames in a
/// row, three at least. A source that stands still has m of its noise alone at every k and does not
/// repeat. Frames are taken to be evenly spaced. One thread.
class Repetition {
 public:
  static constexpr int kMostFrames = 80;

  /// Takes the newest frame; returns after how many frames it repeats, if it does.
  std::optional<int> add(const Volume& frame);
  /// m at its largest up to the period that was found: how different frames of a cycle are.
  double contrast() const { return contrast_; }
  /// Of the last k frames (the newest is k - 1) the one that the newest before add() or this frame
  /// is most like, and how far it is.
  struct NearestFrame {
    int frame = 0;
    double distance = 0.0;
  };
  /// The last k frames as they are now, to compare others with.
  std::vector<std::vector<float>> last(int k) const;
  static NearestFrame nearest(const Volume& frame, const std::vector<std::vector<float>>& of);
  /// The same in a cycle of which this frame is expected to be frame `expected` (any number, not
  /// whole): of all that are like it to within `as_like` of the best, the one nearest to that. What
  /// goes to and fro looks the same twice in a cycle.
  static NearestFrame nearest(const Volume& frame, const std::vector<std::vector<float>>& of,
                              double expected, double as_like);
  void clear();

 private:
  std::deque<std::vector<float>> means_;       ///< the newest last
  std::deque<std::vector<double>> distances_;  ///< of each: to the one k before it, at k - 1
  int found_ = 0, in_a_row_ = 0;
  double contrast_ = 0.0;
};

}  // namespace palpate
