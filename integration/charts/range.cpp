#include "integration/charts/range.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "compute/volume/portable.h"

namespace palpate::charts {
namespace {

constexpr size_t kStatisticsSamples = 400'000;

size_t stride_for(size_t count, size_t limit) {
  return std::max<size_t>(1, count / limit);
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return 0.0;
  const auto rank = values.begin() + long(q * double(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), rank, values.end());
  return *rank;
}

Range window_of(const Volume& volume) {
  std::vector<double> values;
  const size_t stride = stride_for(volume.values.size(), kStatisticsSamples);
  for (size_t n = 0; n < volume.values.size(); n += stride) values.push_back(volume.values[n]);
  Range window{quantile(values, 0.005), quantile(values, 0.995)};
  if (window.high <= window.low) {
    // Few voxels differ, or none: show whatever there is.
    const double middle = window.low;
    window = {quantile(values, 0.0), quantile(values, 1.0)};
    const double half = std::max(0.5, 1e-3 * std::abs(middle));
    if (window.high <= window.low) window = {middle - half, middle + half};
  }
  return window;
}

Range round_range(const std::vector<double>& values) {
  const double top = quantile(values, 0.995);
  if (!(top > 1e-9)) return {0.0, 1.0};
  const double decade = std::pow(10.0, std::floor(std::log10(top)));
  for (const double step : {1.0, 1.2, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (step * decade >= top * 0.999) return {0.0, step * decade};
  }
  return {0.0, 10.0 * decade};
}

void visit_samples(const Grid& grid, size_t limit, const std::function<void(glm::dvec3)>& visit) {
  // One stride for all axes keeps the samples spread like the grid itself.
  const double ratio = double(grid.count()) / double(std::max<size_t>(limit, 1));
  const int stride = std::max(1, int(std::ceil(portable::cube_root(ratio))));
  for (int k = 0; k < grid.size.z; k += stride) {
    for (int j = 0; j < grid.size.y; j += stride) {
      for (int i = 0; i < grid.size.x; i += stride) visit(grid.lps_from_index({i, j, k}));
    }
  }
}

std::vector<double> sampled_lengths_mm(const Field& field) {
  std::vector<double> lengths;
  const size_t stride = stride_for(field.u_mm.size(), kStatisticsSamples);
  for (size_t n = 0; n < field.u_mm.size(); n += stride) {
    lengths.push_back(glm::length(glm::dvec3(field.u_mm[n])));
  }
  return lengths;
}

double round_down_125(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {5.0, 2.0, 1.0}) {
    if (step * decade <= value * (1.0 + 1e-9)) return step * decade;
  }
  return decade;
}

std::string number(double value) {
  if (std::abs(value) < 1e-12) return "0";
  const double size = std::abs(value);
  std::string text =
      size >= 99.95 && size < 1e6 ? fmt::format("{:.0f}", size) : fmt::format("{:.3g}", size);
  return value < 0 ? "\u2212" + text : text;
}

}  // namespace palpate::charts
