#include "module/view/light_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
// Cosine of 2 degrees: the light turns with the head, and shadows follow it in steps of this.
constexpr float kTurned = 0.9994F;
// The number of cells is a multiple of this, so that all levels have the same shape.
constexpr int kMultiple = 1 << (kLightLevels - 1);

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

glm::ivec3 rows(glm::ivec3 size) {
  return {(size.x + 63) / 64, size.y, size.z};
}

}  // namespace

LightGrid::LightGrid(std::shared_ptr<vulkan::Context> context, Kernels& kernels)
    : context_(std::move(context)), kernels_(kernels) {}

void LightGrid::record(vulkan::Recorder& recorder, std::span<const ViewVolume> volumes,
                       std::span<const ShownVolume* const> drawn, bool changed,
                       const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                       const Read& read, ViewParameters& parameters) {
  // The box of all volumes along the world's axes.
  glm::dvec3 low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
  double finest = std::numeric_limits<double>::max();
  Depends depends;
  for (size_t v = 0; v < drawn.size(); ++v) {
    const ResidentFrames& frames = *drawn[v]->resident().frames;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 end(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::dvec3 at =
          world_from_voxel(volumes[v], frames.place, glm::dvec3(frames.place.size) * end - 0.5);
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
    finest = std::min(finest, finest_m(volumes[v], frames));
    depends.volumes.emplace_back(drawn[v], volumes[v].world_from_volume);
  }
  // Cubic cells in it.
  const glm::dvec3 extent = high - low;
  const double edge = std::max(std::max({extent.x, extent.y, extent.z}) / (kLongest - 2 * kMargin),
                               kLeastVoxels * finest);
  for (int a = 0; a < 3; ++a) {
    const int needed = int(std::ceil(extent[a] / edge)) + 2 * kMargin;
    depends.cells[a] = (needed + kMultiple - 1) / kMultiple * kMultiple;
  }
  const glm::dvec3 corner =
      0.5 * (low + high) - 0.5 * edge * glm::dvec3(depends.cells) + 0.5 * edge;
  depends.corner = glm::vec4(corner, edge);
  for (size_t p = 0; p < scene.clips.size(); ++p) depends.planes.push_back(parameters.planes[p]);
  depends.light = parameters.light;

  parameters.light_corner = depends.corner;
  parameters.light_cells = glm::vec4(glm::vec3(depends.cells), scene.shadows);
  for (size_t e = 0; e < eyes.size(); ++e)
    parameters.light_rays[e] = rays_of(eyes[e], size, corner, edge);
  if (!changed && glm::dot(glm::vec3(depends.light), glm::vec3(known_.light)) > kTurned)
    depends.light = known_.light;
  if (!changed && depends == known_) return;

  if (depends.cells != known_.cells) {
    for (size_t l = 0; l < levels_.size(); ++l) {
      levels_[l] = vulkan::Image(context_, depends.cells >> int(l), VK_FORMAT_R32_SFLOAT);
      recorder.prepare(levels_[l]);
    }
    light_ = vulkan::Image(context_, depends.cells,
                           context_->is_cpu() ? VK_FORMAT_R32G32_SFLOAT : VK_FORMAT_R16G16_SFLOAT);
    recorder.prepare(light_);
  }
  // A turn of the light alone leaves the extinction as it is.
  Depends turned = known_;
  turned.light = depends.light;
  const bool same_density = !changed && turned == depends;
  known_ = std::move(depends);
  if (!same_density) record_density(recorder, volumes, drawn, read);
  const auto level = [&](size_t l) { return vulkan::Binding(levels_[l], kernels_.linear()); };
  recorder.dispatch(kernels_.light(),
                    {read.parameters, level(0), level(1), level(2), level(3), level(4), light_},
                    nullptr, rows(known_.cells));
}

void LightGrid::record_density(vulkan::Recorder& recorder, std::span<const ViewVolume> volumes,
                               std::span<const ShownVolume* const> drawn, const Read& read) {
  const glm::dvec3 corner(known_.corner);
  const double edge = known_.corner.w;
  for (size_t v = 0; v < drawn.size(); ++v) {
    const GridPlace& place = drawn[v]->resident().frames->place;
    const Transform& transform = volumes[v].world_from_volume;
    LightDensityPush push{};
    push.cells = glm::ivec4(known_.cells, v > 0 ? 1 : 0);
    // voxel = index_from_volume (R^T (corner + edge cell - t) / s) + offset
    const auto voxel = [&](glm::dvec3 cell) {
      return place.index(transform.volume_from_world(corner + edge * cell));
    };
    const glm::dvec3 first = voxel(glm::dvec3(0.0));
    glm::dmat3 along;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 axis(0.0);
      axis[a] = 1.0;
      along[a] = voxel(axis) - first;
    }
    for (int row = 0; row < 3; ++row)
      push.voxel_from_cell[row] =
          glm::vec4(along[0][row], along[1][row], along[2][row], first[row]);
    // Extinction is per mm of the volume, however it is scaled.
    const double scale = std::cbrt(transform.scale.x * transform.scale.y * transform.scale.z);
    push.volume = glm::vec4(float(v), 1e3 * edge / scale, 0.0, 0.0);
    recorder.dispatch(kernels_.light_density(read.skip_texels.whole()),
                      {read.parameters,
                       read.tables,
                       read.skip_texels,
                       read.skip,
                       {drawn[v]->surface(), kernels_.linear()},
                       {levels_[0], kernels_.nearest()},
                       levels_[0]},
                      push, rows(known_.cells));
  }
  for (size_t l = 1; l < levels_.size(); ++l)
    recorder.dispatch(kernels_.light_halve(), {{levels_[l - 1], kernels_.nearest()}, levels_[l]},
                      LightHalvePush{glm::ivec4(levels_[l].size(), 0)}, rows(levels_[l].size()));
}

}  // namespace palpate::view
