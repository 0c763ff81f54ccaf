#pragma once

#include <memory>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"
#include "module/view/kernels.h"

namespace palpate::view {

/// Draws rays for a lattice of pixels first, and then only for those of the others around which the
/// picture is not smooth: see between.comp.
class RayLattice {
 public:
  /// For pictures of at most so many eyes of this size.
  RayLattice(std::shared_ptr<vulkan::Context> context, PictureSize most, int most_eyes);

  /// What between.comp reads and writes besides the lattice.
  struct Pictures {
    const vulkan::Buffer &parameters, &thing_depth, &visible, &backdrop, &colour, &depth;
  };

  /// rays: bindings of raycast.comp, points() and list() among them.
  void record(vulkan::Recorder& recorder, Kernels& kernels, PictureSize size, int eyes,
              const RaycastChoices& choices, const std::vector<vulkan::Binding>& rays,
              const Pictures& pictures) const;

  const vulkan::Buffer& points() const { return points_; }
  const vulkan::Buffer& list() const { return list_; }

 private:
  vulkan::Buffer points_, list_, list_start_;
};

}  // namespace palpate::view
