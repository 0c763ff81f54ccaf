#pragma once

#include <memory>
#include <vector>

#include "integration/app/gpu.h"
#include "integration/charts/canvas.h"
#include "module/session/viewer.h"

namespace palpate::app {

/// Pictures of a scene that go to files, for one eye or two, from a place that sees all of it.
class StillPicture {
 public:
  /// Opens the Vulkan device. eyes: 1 or 2.
  static Result<std::unique_ptr<StillPicture>> open(const DeviceOptions& gpu,
                                                    const ViewChoices& view, PictureSize size,
                                                    int eyes);

  /// Draws `scene` as it is in `moment` and waits for it. One raster per eye, left one first.
  /// tubes: that a hand has released, or null.
  Result<std::vector<charts::Raster>> take(std::shared_ptr<const Scene> scene,
                                           const SceneMoment& moment,
                                           std::shared_ptr<const ReleasedTubes> tubes = nullptr);
  /// What the last picture shows.
  const ViewScene& scene() const { return viewer_->shown(); }

 private:
  StillPicture(std::unique_ptr<Viewer> viewer, PictureSize size, int eyes)
      : viewer_(std::move(viewer)), size_(size), eyes_(eyes) {}

  std::unique_ptr<Viewer> viewer_;
  PictureSize size_;
  int eyes_;
};

}  // namespace palpate::app
