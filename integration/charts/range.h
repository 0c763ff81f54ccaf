#pragma once

#include <functional>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate::charts {

/// The range of numbers of a map of colours or greys; high > low.
struct Range {
  double low = 0;
  double high = 1;

  double fraction(double value) const { return (value - low) / (high - low); }
};

/// The q-quantile, q in [0, 1], of the finite values; 0 if there are none.
double quantile(std::vector<double> values, double q);

/// The window in which a frame is shown: the 0.5 and 99.5 percentiles of its values, so that a few
/// bright voxels do not make the rest black. A constant volume gets a window around its value.
Range window_of(const Volume& volume);

/// 0 to a round number that just holds the largest of `values` but for the highest half percent.
Range round_range(const std::vector<double>& values);

/// Calls `visit` with the LPS positions of at most about `limit` samples of a grid, evenly spread
/// over it.
void visit_samples(const Grid& grid, size_t limit, const std::function<void(glm::dvec3)>& visit);

/// Lengths of u in mm at samples spread over the field.
std::vector<double> sampled_lengths_mm(const Field& field);

/// The largest of 1, 2 and 5 times a power of ten that is at most `value`; value > 0.
double round_down_125(double value);

/// A number as short as people write it: three digits, a real minus sign, no exponent where it can
/// be helped.
std::string number(double value);

}  // namespace palpate::charts
