#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/image.h"
#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"
#include "module/view/kernels.h"
#include "module/view/shown_volume.h"
#include "module/view/view_scene.h"
#include "shaders/interface/view.h"

namespace palpate::view {

/// How much light reaches each place between the volumes of a picture: cubic cells over all of
/// them, at most kLongest along an axis, with ambient occlusion and soft shadow. The cells lie
/// along the axes of the first volume and are scaled with it, so a scene that moves as a whole
/// keeps them. Computed again only when something that it depends on has changed.
class LightGrid {
 public:
  LightGrid(std::shared_ptr<vulkan::Context> context, Kernels& kernels);

  /// What the kernels read besides the volumes.
  struct Read {
    const vulkan::Buffer& parameters;
    const vulkan::TexelView &tables, &skip_texels;
    const vulkan::Buffer& skip;
  };

  /// Sets the light grid's part of the parameters, whose other parts are set already, and records
  /// what the light needs: nothing where volumes, cuts and light are those of the last call.
  /// drawn[v] is volumes[v]; changed: any of them was brought to another phase or look. Throws as
  /// vulkan::Image does.
  void record(vulkan::Recorder& recorder, std::span<const ViewVolume> volumes,
              std::span<const ShownVolume* const> drawn, bool changed, const ViewScene& scene,
              std::span<const Eye> eyes, PictureSize size, const Read& read,
              view_shaders::ViewParameters& parameters);

  /// Ambient and direct light of each cell, 0 to 1.
  const vulkan::Image& light() const { return light_; }

  /// How often it was computed, and of these how often only for another direction of the light.
  int made() const { return made_; }
  int turned() const { return turned_; }

 private:
  /// What the light depends on besides phases and looks.
  struct Depends {
    std::vector<const ShownVolume*> volumes;
    /// Rows: of each volume three, voxel = row . (cell, 1); then of each plane one, in cells.
    std::vector<glm::dvec4> rows;
    glm::ivec3 cells{0};
    glm::dvec3 light{0.0};  ///< towards the light, along the axes of the cells
  };
  static bool same_places(const Depends& a, const Depends& b);
  void record_density(vulkan::Recorder& recorder, std::span<const double> edges_mm,
                      std::span<const ShownVolume* const> drawn, const Read& read);

  std::shared_ptr<vulkan::Context> context_;
  Kernels& kernels_;
  std::array<vulkan::Image, size_t(view_shaders::kLightLevels)> levels_;
  vulkan::Image light_;
  Depends known_;
  int made_ = 0, turned_ = 0;
};

}  // namespace palpate::view
