#include "integration/app/still_picture.h"

namespace palpate::app {
namespace {

charts::Raster raster_of(const Picture& picture) {
  charts::Raster raster{picture.width, picture.height, {}};
  raster.pixels.reserve(picture.colours.size());
  // R in the lowest byte becomes R above G above B, opaque.
  for (const uint32_t c : picture.colours)
    raster.pixels.push_back(0xff000000u | (c & 0xffu) << 16 | (c & 0xff00u) | (c >> 16 & 0xffu));
  return raster;
}

}  // namespace

Result<std::unique_ptr<StillPicture>> StillPicture::open(const DeviceOptions& gpu,
                                                         const ViewChoices& view, PictureSize size,
                                                         int eyes) {
  vulkan::ContextOptions options;
  options.device = gpu.device;
  const auto context = vulkan::Context::open(options);
  if (!context) return context.error();
  auto viewer = Viewer::open(*context, view, {.most = size, .most_eyes = eyes});
  if (!viewer) return viewer.error();
  return std::unique_ptr<StillPicture>(new StillPicture(std::move(*viewer), size, eyes));
}

Result<std::vector<charts::Raster>> StillPicture::take(std::shared_ptr<const Scene> scene,
                                                       const SceneMoment& moment,
                                                       std::shared_ptr<const ReleasedTubes> tubes) {
  viewer_->show(std::move(tubes));
  if (const Status set = viewer_->update(std::move(scene)); !set) return set.error();
  glm::dvec3 low, high;
  viewer_->picture().box(moment, low, high);
  std::array<Eye, 2> eyes = eyes_before(low, high, size_);
  if (eyes_ == 1) eyes[0] = eye_before(low, high, size_);
  // What goes to a file is seen at the moment of its tick.
  if (const Status started =
          viewer_->start(moment, moment.now_ns, {eyes.data(), size_t(eyes_)}, size_);
      !started)
    return started.error();
  std::vector<charts::Raster> rasters;
  for (int eye = 0; eye < eyes_; ++eye) {
    const auto picture = viewer_->renderer().read_back(eye);
    if (!picture) return picture.error();
    rasters.push_back(raster_of(*picture));
  }
  return rasters;
}

}  // namespace palpate::app
