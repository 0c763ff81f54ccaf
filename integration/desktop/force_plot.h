#pragma once

#include <deque>

#include "integration/charts/canvas.h"

namespace palpate::desktop {

/// The force of the last seconds, as a strip that moves to the left: newest at its right edge. The
/// scale fits the greatest force in the strip, in steps that people read easily (1, 2, 5 N).
class ForcePlot {
 public:
  explicit ForcePlot(double seconds = 6.0) : seconds_(seconds) {}

  /// The force was force_n (>= 0) at time_s; times rise. What is not finite is left out, and so is
  /// a time that does not rise.
  void add(double time_s, double force_n);
  /// The top of the scale now, N.
  double top_n() const { return top_n_; }
  /// What the strip shows, N: the newest force, and the greatest one.
  double newest_n() const { return samples_.empty() ? 0.0 : samples_.back().force_n; }
  double peak_n() const;

  /// width by height in units of scale pixels each.
  charts::Bitmap draw(int width, int height, double scale) const;

 private:
  struct PlottedForce {
    double time_s, force_n;
  };
  void draw_curve(charts::Canvas& canvas, glm::dvec2 corner, glm::dvec2 size, double scale) const;

  double seconds_;
  double top_n_ = 1.0;
  std::deque<PlottedForce> samples_;
};

/// The smallest of 1, 2, 5, 10, 20 ... that is at least `force_n`; 1 for less.
double readable_top(double force_n);

}  // namespace palpate::desktop
