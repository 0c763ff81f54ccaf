#include "integration/charts/contents.h"

#include <cmath>
#include <limits>

namespace palpate::charts {
namespace {

double confidence_at(const Confidence& confidence, glm::dvec3 lps_mm) {
  // Nearest: a confidence belongs to a cell; blending two would give a value that neither has.
  const Grid& grid = confidence.grid;
  const glm::dvec3 index = glm::clamp(glm::round(grid.index_from_lps(lps_mm)), glm::dvec3(0.0),
                                      glm::dvec3(grid.size - 1));
  const glm::ivec3 cell(index);
  return confidence.values[grid.offset(cell.x, cell.y, cell.z)];
}

uint32_t packed(Color color) {
  const auto byte = [](double v) { return uint32_t(std::lround(255.0 * v)); };
  return 0xFF000000u | (byte(color.r) << 16) | (byte(color.g) << 8) | byte(color.b);
}

}  // namespace

bool covers(const Grid& grid, glm::dvec3 lps_mm) {
  const glm::dvec3 index = grid.index_from_lps(lps_mm);
  return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThan(index, glm::dvec3(grid.size) - 0.5));
}

bool inside(const Mask* mask, glm::dvec3 lps_mm) {
  if (!mask) return true;
  if (!covers(mask->grid, lps_mm)) return false;
  const glm::ivec3 voxel = glm::clamp(glm::ivec3(glm::round(mask->grid.index_from_lps(lps_mm))),
                                      glm::ivec3(0), mask->grid.size - 1);
  return mask->values[mask->grid.offset(voxel.x, voxel.y, voxel.z)] != 0;
}

double difference_at(const Volume& fixed, const Volume& moving, const Field* field,
                     glm::dvec3 lps_mm) {
  if (!covers(fixed.grid, lps_mm)) return std::numeric_limits<double>::quiet_NaN();
  const glm::dvec3 there_mm = field ? lps_mm + sample_at_lps(*field, lps_mm) : lps_mm;
  return sample(moving, moving.grid.index_from_lps(there_mm)) -
         sample(fixed, fixed.grid.index_from_lps(lps_mm));
}

Content frame_content(const Volume& frame, Range window) {
  return {[&frame, window](glm::dvec3 lps_mm) -> std::optional<Color> {
            if (!covers(frame.grid, lps_mm)) return std::nullopt;
            const double value = sample(frame, frame.grid.index_from_lps(lps_mm));
            return color_at(ColorMap::kGray, window.fraction(value));
          },
          {},
          true};
}

Content motion_content(const Field& field, const Grid& where, Range range_mm) {
  return {[&field, where, range_mm](glm::dvec3 lps_mm) -> std::optional<Color> {
            if (!covers(where, lps_mm)) return std::nullopt;
            const double length_mm = glm::length(sample_at_lps(field, lps_mm));
            return color_at(ColorMap::kMotion, range_mm.fraction(length_mm));
          },
          {},
          true};
}

Content error_content(const Field& field, const Field& truth, const Mask* mask, Range range_mm) {
  return {[&field, &truth, mask, range_mm](glm::dvec3 lps_mm) -> std::optional<Color> {
            if (!covers(truth.grid, lps_mm) || !inside(mask, lps_mm)) return std::nullopt;
            const double miss_mm =
                glm::length(sample_at_lps(field, lps_mm) - sample_at_lps(truth, lps_mm));
            return color_at(ColorMap::kError, range_mm.fraction(miss_mm));
          },
          {},
          false};
}

Content confidence_content(const Confidence& confidence, const Grid& where) {
  return {[&confidence, where](glm::dvec3 lps_mm) -> std::optional<Color> {
            if (!covers(where, lps_mm)) return std::nullopt;
            return color_at(ColorMap::kConfidence, confidence_at(confidence, lps_mm));
          },
          {},
          false};
}

Content difference_content(const Volume& fixed, const Volume& moving, const Field* field,
                           Range range) {
  return {[&fixed, &moving, field, range](glm::dvec3 lps_mm) -> std::optional<Color> {
            const double difference = difference_at(fixed, moving, field, lps_mm);
            if (std::isnan(difference)) return std::nullopt;
            return color_at(ColorMap::kDifference, range.fraction(difference));
          },
          {},
          false};
}

Bitmap rasterised(const Content& content, const Panel& panel) {
  Bitmap raster{int(panel.size_px.x), int(panel.size_px.y), {}};
  raster.pixels.reserve(size_t(raster.width) * size_t(raster.height));
  for (int row = 0; row < raster.height; ++row) {
    for (int column = 0; column < raster.width; ++column) {
      const glm::dvec2 px = panel.corner_px + glm::dvec2(column + 0.5, row + 0.5);
      const auto color = content.color(panel.lps_at(px));
      raster.pixels.push_back(color ? packed(*color) : 0u);
    }
  }
  return raster;
}

}  // namespace palpate::charts
