#include "module/scene/transfer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Error transfer_refused(const std::string& what) {
  return {ErrorKind::kBadInput, "This transfer function can not be used: " + what + "."};
}

/// Empty if the pairs are fit to be evaluated without ever giving NaN, else what to change.
std::string fault_of(const std::vector<double>& in, const std::vector<double>& out) {
  if (in.empty()) return "it has no pairs; give at least one (in, out) pair";
  if (in.size() != out.size()) return "it needs as many outputs as inputs";
  for (size_t k = 0; k < in.size(); ++k)
    if (!std::isfinite(in[k]) || !std::isfinite(out[k]))
      return "pair " + std::to_string(k) + " is not finite; give plain numbers";
  for (size_t k = 1; k < in.size(); ++k) {
    if (in[k] < in[k - 1])
      return "the input of pair " + std::to_string(k) +
             " is smaller than the one before; sort the pairs by their input";
    if (!std::isfinite(in[k] - in[k - 1]) || !std::isfinite(out[k] - out[k - 1]))
      return "the step to pair " + std::to_string(k) + " is too large; give smaller numbers";
  }
  return {};
}

}  // namespace

TransferFunction TransferFunction::constant(double out) {
  assert(std::isfinite(out));
  TransferFunction f;
  if (std::isfinite(out)) f.in_ = {0.0}, f.out_ = {out};
  return f;
}

Result<TransferFunction> TransferFunction::linear(std::vector<double> in, std::vector<double> out) {
  if (const std::string fault = fault_of(in, out); !fault.empty()) return transfer_refused(fault);
  TransferFunction f;
  f.in_ = std::move(in);
  f.out_ = std::move(out);
  return f;
}

Result<TransferFunction> TransferFunction::stepped(std::vector<double> in,
                                                   std::vector<double> out) {
  auto f = linear(std::move(in), std::move(out));
  if (f) f->stepped_ = true;
  return f;
}

Result<TransferFunction> TransferFunction::window(double level, double width, double full) {
  if (!(width >= 0.0)) return transfer_refused("its width is negative; give 0 or more");
  return linear({level - width / 2, level + width / 2}, {0.0, full});
}

double TransferFunction::operator()(double in) const noexcept {
  // NaN has no place on the axis: nothing is felt there.
  if (in_.empty() || std::isnan(in)) return 0.0;
  const size_t above = size_t(std::upper_bound(in_.begin(), in_.end(), in) - in_.begin());
  if (above == 0) return out_.front();
  if (above == in_.size() || stepped_) return out_[above - 1];
  // in_[above - 1] <= in < in_[above], so the divisor is not zero.
  const double a = out_[above - 1], b = out_[above];
  const double share = (in - in_[above - 1]) / (in_[above] - in_[above - 1]);
  // Rounding could pass the upper end by one bit, but highest() is guaranteed.
  return std::clamp(a + (b - a) * share, std::min(a, b), std::max(a, b));
}

double TransferFunction::highest() const noexcept {
  return out_.empty() ? 0.0 : *std::max_element(out_.begin(), out_.end());
}

std::pair<double, double> TransferFunction::support() const noexcept {
  const auto felt = [](double out) { return out > 0.0; };
  const size_t n = out_.size();
  const size_t first = size_t(std::find_if(out_.begin(), out_.end(), felt) - out_.begin());
  if (first == n) return {kInfinity, -kInfinity};
  size_t last = n - 1;
  while (!felt(out_[last])) --last;
  // A linear piece begins to rise at the pair before; a step holds up to the pair after.
  const double low = first == 0 ? -kInfinity : in_[stepped_ ? first : first - 1];
  return {low, last == n - 1 ? kInfinity : in_[last + 1]};
}

}  // namespace palpate
