#include "module/view/light_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compute/volume/portable.h"
#include "module/view/parameters.h"

namespace palpate::view {

using namespace view_shaders;

namespace {

// Cells along the longest axis, at most; a quarter of the voxels of most volumes.
constexpr int kLongest = 48;
// Voxels along the edge of a cell, at least: finer cells would show the voxels' steps.
constexpr double kLeastVoxels = 2.0;
// Cells beyond the volumes on each side, so that rays enter the grid in the open.
constexpr int kMargin = 2;
// A place of the grid that moves by less than so many voxels or cells has not moved.
constexpr double kMoved = 0.01;
// Cosine of 2 degrees: the light turns with the head, and shadows follow it in steps of this.
constexpr double kTurned = 0.9994F;
// The number of cells is a multiple of this, so that all levels have the same shape.
constexpr int kMultiple = 1 << (kLightLevels - 1);

/// By how much a volume is scaled on the whole.
double scale_of(const Transform& transform) {
  return portable::cube_root(transform.scale.x * transform.scale.y * transform.scale.z);
}

/// Where the grid is: along the axes of the volume, scaled with it, with cubic cells.
Transform world_from_grid_of(const Transform& world_from_volume) {
  Transform grid = world_from_volume;
  grid.scale = glm::dvec3(scale_of(world_from_volume));
  return grid;
}

/// A place in the world from an index of the volume's voxels.
glm::dvec3 world_from_voxel(const ViewVolume& volume, const GridPlace& place, glm::dvec3 voxel) {
  return volume.world_from_volume.world_from_volume(glm::inverse(place.index_from_volume) *
                                                    (voxel - place.offset));
}

/// Edge of a finest voxel in the world, m.
double finest_m(const ViewVolume& volume, const ResidentFrames& frames) {
  const glm::dvec3 mm = frames.spacing_mm, scale = volume.world_from_volume.scale;
  return 1e-3 * std::min({mm.x, mm.y, mm.z}) * std::min({scale.x, scale.y, scale.z});
}

glm::ivec3 rows_of(glm::ivec3 size) {
  return {(size.x + 63) / 64, size.y, size.z};
}

}  // namespace

LightGrid::LightGrid(std::shared_ptr<vulkan::Context> context, Kernels& kernels)
    : context_(std::move(context)), kernels_(kernels) {}

/// Whether no place of the grid has moved in a volume or against a plane, but for rounding.
bool LightGrid::same_places(const Depends& a, const Depends& b) {
  if (a.volumes != b.volumes || a.cells != b.cells || a.rows.size() != b.rows.size()) return false;
  for (size_t r = 0; r < a.rows.size(); ++r) {
    const glm::dvec4 difference = glm::abs(a.rows[r] - b.rows[r]);
    if (kLongest * (difference.x + difference.y + difference.z) + difference.w > kMoved)
      return false;
  }
  return true;
}

void LightGrid::record(vulkan::Recorder& recorder, std::span<const ViewVolume> volumes,
                       std::span<const ShownVolume* const> drawn, bool changed,
                       const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                       const Read& read, ViewParameters& parameters) {
  // The box of all volumes along the axes of the grid's space, m of the first volume.
  const Transform world_from_grid = world_from_grid_of(volumes[0].world_from_volume);
  const double scale = world_from_grid.scale.x;
  glm::dvec3 low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
  double finest = std::numeric_limits<double>::max();
  for (size_t v = 0; v < drawn.size(); ++v) {
    const ResidentFrames& frames = *drawn[v]->resident().frames;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 end(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::dvec3 at = world_from_grid.volume_from_world(
          world_from_voxel(volumes[v], frames.place, glm::dvec3(frames.place.size) * end - 0.5));
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
    finest = std::min(finest, finest_m(volumes[v], frames) / scale);
  }
  // Cubic cells in it.
  Depends depends;
  depends.volumes.assign(drawn.begin(), drawn.end());
  const glm::dvec3 extent = high - low;
  const double edge = std::max(std::max({extent.x, extent.y, extent.z}) / (kLongest - 2 * kMargin),
                               kLeastVoxels * finest);
  for (int a = 0; a < 3; ++a) {
    // Rounding alone must not make another cell of an extent that is a whole number of cells.
    const int needed = int(std::ceil(extent[a] / edge - kMoved)) + 2 * kMargin;
    depends.cells[a] = (needed + kMultiple - 1) / kMultiple * kMultiple;
  }
  const glm::dvec3 corner =
      0.5 * (low + high) - 0.5 * edge * glm::dvec3(depends.cells) + 0.5 * edge;
  // Where the cells lie in the volumes, and the planes in them.
  const auto world_from_cell = [&](glm::dvec3 cell) {
    return world_from_grid.world_from_volume(corner + edge * cell);
  };
  std::vector<double> edges_mm;
  for (size_t v = 0; v < drawn.size(); ++v) {
    const GridPlace& place = drawn[v]->resident().frames->place;
    const auto voxel = [&](glm::dvec3 cell) {
      return place.index(volumes[v].world_from_volume.volume_from_world(world_from_cell(cell)));
    };
    const glm::dvec3 first = voxel(glm::dvec3(0.0));
    glm::dmat3 along;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 axis(0.0);
      axis[a] = 1.0;
      along[a] = voxel(axis) - first;
    }
    for (int row = 0; row < 3; ++row)
      depends.rows.emplace_back(along[0][row], along[1][row], along[2][row], first[row]);
    edges_mm.push_back(1e3 * edge * scale / scale_of(volumes[v].world_from_volume));
  }
  const glm::dquat grid_from_world = glm::conjugate(world_from_grid.rotation);
  for (size_t p = 0; p < scene.clips.size(); ++p) {
    const ClipPlane& plane = scene.clips[p];
    depends.rows.emplace_back(
        grid_from_world * plane.normal,
        (plane.offset_m - glm::dot(plane.normal, world_from_cell(glm::dvec3(0.0)))) /
            (edge * scale));
    parameters.light_planes[p] = glm::vec4(depends.rows.back());
  }
  depends.light = grid_from_world * glm::dvec3(parameters.light);

  parameters.light_way = glm::vec4(depends.light, 0.0);
  parameters.light_cells = glm::vec4(glm::vec3(depends.cells), scene.shadows);
  for (size_t e = 0; e < eyes.size(); ++e) {
    Eye eye = eyes[e];
    eye.position_m = grid_from_world * (eye.position_m - world_from_grid.translation_m);
    eye.orientation = grid_from_world * eye.orientation;
    parameters.light_rays[e] = rays_of(eye, size, corner * scale, edge * scale);
  }
  const bool same_density = !changed && same_places(depends, known_);
  if (same_density && glm::dot(depends.light, known_.light) > kTurned) return;

  if (depends.cells != known_.cells) {
    for (size_t l = 0; l < levels_.size(); ++l) {
      levels_[l] = vulkan::Image(context_, depends.cells >> int(l), VK_FORMAT_R32_SFLOAT);
      recorder.prepare(levels_[l]);
    }
    light_ = vulkan::Image(context_, depends.cells, VK_FORMAT_R16G16_SFLOAT);
    recorder.prepare(light_);
  }
  // A turn of the light alone leaves the extinction as it is.
  if (same_density) depends.rows = known_.rows;
  known_ = std::move(depends);
  ++made_;
  turned_ += same_density;
  if (!same_density) record_density(recorder, edges_mm, drawn, read);
  const auto level = [&](size_t l) { return vulkan::Binding(levels_[l], kernels_.linear()); };
  recorder.dispatch(kernels_.light(),
                    {read.parameters, level(0), level(1), level(2), level(3), level(4), light_},
                    nullptr, rows_of(known_.cells));
}

void LightGrid::record_density(vulkan::Recorder& recorder, std::span<const double> edges_mm,
                               std::span<const ShownVolume* const> drawn, const Read& read) {
  for (size_t v = 0; v < drawn.size(); ++v) {
    LightDensityPush push{};
    push.cells = glm::ivec4(known_.cells, v > 0 ? 1 : 0);
    for (size_t row = 0; row < 3; ++row)
      push.voxel_from_cell[row] = glm::vec4(known_.rows[3 * v + row]);
    push.volume = glm::vec4(float(v), edges_mm[v], 0.0, 0.0);
    recorder.dispatch(kernels_.light_density(read.skip_texels.whole()),
                      {read.parameters,
                       read.tables,
                       read.skip_texels,
                       read.skip,
                       {drawn[v]->surface(), kernels_.linear()},
                       {levels_[0], kernels_.nearest()},
                       levels_[0]},
                      push, rows_of(known_.cells));
  }
  for (size_t l = 1; l < levels_.size(); ++l)
    recorder.dispatch(kernels_.light_halve(), {{levels_[l - 1], kernels_.nearest()}, levels_[l]},
                      LightHalvePush{glm::ivec4(levels_[l].size(), 0)}, rows_of(levels_[l].size()));
}

}  // namespace palpate::view
