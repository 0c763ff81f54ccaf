#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "compute/vulkan/image.h"
#include "compute/vulkan/kernel.h"

namespace palpate::view {

/// What the kernel of the rays is compiled for.
struct RaycastChoices {
  int volumes = 1;  ///< to kMostVolumes
  bool things = false;
  bool skip = true;       ///< off: marches everywhere, for measurements
  bool count = false;     ///< samples are counted, for measurements
  bool masked = false;    ///< not all pixels are visible
  bool texels = true;     ///< skip words are read as texels
  uint32_t backdrop = 0;  ///< see view::backdrop_bits(); 0: none
  bool lit = false;       ///< the light grid is read
  bool refines = true;    ///< see RendererOptions
};

/// Every kernel of the view, compiled when first asked for and kept. Any thread.
class Kernels {
 public:
  explicit Kernels(std::shared_ptr<vulkan::Context> context);

  const vulkan::Kernel& prefilter();
  const vulkan::Kernel& curve();
  /// texels: the terms are read as texels, not from the buffer that they lie in.
  const vulkan::Kernel& motion_at(bool texels);
  const vulkan::Kernel& motion_blend();
  const vulkan::Kernel& track();
  /// curved: of a frame that curve() made.
  const vulkan::Kernel& ranges(bool curved);
  /// carried: by one motion for all times.
  const vulkan::Kernel& mark(bool carried);
  const vulkan::Kernel& list();
  const vulkan::Kernel& need();
  /// moves: nodes are read; blends: the next frame is read.
  const vulkan::Kernel& brick(bool moves, bool blends);
  const vulkan::Kernel& carry();
  const vulkan::Kernel& distance(int axis);
  /// pass: 0 for depths, 1 for what is at the nearest.
  const vulkan::Kernel& things(int pass);
  const vulkan::Kernel& meshes(int pass);
  const vulkan::Kernel& mesh_colours();
  /// texels: skip words are read as texels.
  const vulkan::Kernel& light_density(bool texels);
  const vulkan::Kernel& light_halve();
  const vulkan::Kernel& light();
  const vulkan::Kernel& raycast(const RaycastChoices& choices);
  /// Of the choices only things, masked, and backdrop matter.
  const vulkan::Kernel& between(const RaycastChoices& choices);

  const vulkan::Sampler& linear() const { return linear_; }
  const vulkan::Sampler& nearest() const { return nearest_; }

 private:
  template <size_t N>
  const vulkan::Kernel& get(const uint32_t (&spirv)[N], uint32_t push_bytes,
                            std::vector<uint32_t> specialisation = {});

  std::shared_ptr<vulkan::Context> context_;
  /// Bricks along x and y that a workgroup makes, whose common values are computed once. A GPU
  /// hides the time of its reads by many small workgroups, and has less memory for each of them.
  uint32_t group_;
  vulkan::Sampler nearest_, linear_;
  std::mutex mutex_;
  std::map<std::pair<const uint32_t*, std::vector<uint32_t>>, vulkan::Kernel> kernels_;
};

}  // namespace palpate::view
