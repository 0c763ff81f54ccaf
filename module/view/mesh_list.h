#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/recorder.h"
#include "module/view/kernels.h"
#include "module/view/mesh.h"
#include "module/view/picture.h"

namespace palpate::view {

/// Meshes on the device, and the passes that draw them. All are copied there when one is drawn that
/// is not there yet.
class MeshList {
 public:
  explicit MeshList(std::shared_ptr<vulkan::Context> context) : context_(std::move(context)) {}

  /// What the next picture shows; the picture before must have ended.
  void show(const std::vector<PlacedMesh>& meshes, PictureSize size, int eyes);
  /// Records a pass of meshes.comp: 0, the nearest depths; 1, where all nearest depths are known,
  /// the triangles that have them.
  void record(vulkan::Recorder& recorder, Kernels& kernels, int pass,
              const vulkan::Buffer& parameters, const vulkan::Buffer& depth) const;
  /// Records the pass for the colours of what was found.
  void record_colours(vulkan::Recorder& recorder, Kernels& kernels,
                      const vulkan::Buffer& parameters, const vulkan::Buffer& colour) const;

 private:
  struct Resident {
    std::shared_ptr<const Mesh> mesh;
    int first_vertex = 0, first_triangle = 0;
    glm::ivec4 texture{0};  ///< as MeshPart
  };
  void upload(const std::vector<PlacedMesh>& meshes);
  const Resident* find(const std::shared_ptr<const Mesh>& mesh) const;

  std::shared_ptr<vulkan::Context> context_;
  std::vector<Resident> residents_;
  vulkan::Buffer vertices_, triangles_, texels_, parts_, items_;
  vulkan::Buffer nearest_;  ///< a word per pixel, made when first needed
  PictureSize size_;        ///< of the next picture, as are:
  int eyes_ = 0, item_count_ = 0;
};

}  // namespace palpate::view
