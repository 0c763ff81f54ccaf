#pragma once

#include <memory>
#include <vector>

#include "integration/app/feel_view.h"
#include "integration/app/session.h"
#include "integration/charts/canvas.h"

namespace palpate::app {

/// Pictures of a scene that go to files, for one eye or two, from a place that sees all of it.
class StillPicture {
 public:
  /// Opens the Vulkan device. eyes: 1 or 2.
  static Result<std::unique_ptr<StillPicture>> open(const DeviceOptions& gpu,
                                                    const ViewChoices& view, PictureSize size,
                                                    int eyes);
  ~StillPicture();

  /// Draws `scene` as it is in `moment` and waits for it. One raster per eye, left one first.
  Result<std::vector<charts::Raster>> take(std::shared_ptr<const HapticScene> scene,
                                           const SceneMoment& moment);
  /// What the last picture shows.
  const ViewScene& scene() const { return scene_; }

 private:
  StillPicture(const ViewChoices& view, PictureSize size, int eyes);
  std::unique_ptr<VolumeRenderer> renderer_;
  FeelPicture picture_;
  PictureSize size_;
  int eyes_;
  ViewScene scene_;
};

}  // namespace palpate::app
