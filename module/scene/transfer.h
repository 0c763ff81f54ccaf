#pragma once

#include <string>
#include <utility>
#include <vector>

#include "compute/volume/result.h"

namespace palpate {

/// The paper's tau: from a value of the data to a strength or friction. Piecewise (in, out) pairs,
/// linear in between or stepped, or a window. Immutable; evaluation is real-time safe and takes
/// log2(pairs) comparisons.
class TransferFunction {
 public:
  /// Nothing is felt: 0 everywhere.
  TransferFunction() = default;
  /// The same for every value. `out` must be finite.
  static TransferFunction constant(double out);
  /// Linear between pairs, clamped before the first and after the last. Needs at least one pair,
  /// finite, in rising; equal neighbours in `in` make a step there.
  static Result<TransferFunction> linear(std::vector<double> in, std::vector<double> out);
  /// out[k] from in[k] up to in[k + 1]; below in[0] out[0].
  static Result<TransferFunction> stepped(std::vector<double> in, std::vector<double> out);
  /// 0 below level - width / 2, full above level + width / 2, linear in between. width >= 0; 0 is a
  /// step.
  static Result<TransferFunction> window(double level, double width, double full);

  /// At a step the upper piece counts. 0 for NaN.
  double operator()(double in) const noexcept;
  /// The largest value it can give.
  double highest() const noexcept;
  /// The inputs for which it can be above zero: [first, last], infinite where it never ends; first
  /// > last if none.
  std::pair<double, double> support() const noexcept;
  bool is_stepped() const { return stepped_; }
  const std::vector<double>& in() const { return in_; }
  const std::vector<double>& out() const { return out_; }

 private:
  std::vector<double> in_, out_;
  bool stepped_ = false;
};

}  // namespace palpate
