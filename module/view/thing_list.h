#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"
#include "module/view/kernels.h"
#include "module/view/things.h"

namespace palpate::view {

/// A rectangle of a picture, pixels; empty if it has no width.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
};

/// The part of an eye's picture that a thing can touch, a pixel around it included.
PixelBox pixels_of(const RoundCone& thing, const Eye& eye, PictureSize size, double near_m);

/// Opaque things on their way to the device: which of them, and which parts of the pictures.
class ThingList {
 public:
  explicit ThingList(std::shared_ptr<vulkan::Context> context) : context_(std::move(context)) {}

  /// What the next picture shows; the picture before must have ended.
  void show(const Things& things, std::span<const Eye> eyes, PictureSize size, double near_m);
  /// Records a pass of things.comp.
  void record(vulkan::Recorder& recorder, Kernels& kernels, int pass,
              const vulkan::Buffer& parameters, const vulkan::Buffer& depth,
              const vulkan::Buffer& colour) const;

 private:
  std::shared_ptr<vulkan::Context> context_;
  vulkan::Buffer things_, items_;
  int item_count_ = 0;  ///< of the next picture
};

}  // namespace palpate::view
