#include "module/session/viewer.h"

namespace palpate {

Result<std::unique_ptr<Viewer>> Viewer::open(std::shared_ptr<vulkan::Context> context,
                                             const ViewChoices& choices,
                                             const RendererOptions& options) {
  auto renderer = VolumeRenderer::make(std::move(context), options);
  if (!renderer) return renderer.error();
  std::unique_ptr<Viewer> viewer(new Viewer(choices));
  viewer->renderer_ = std::move(*renderer);
  return viewer;
}

Viewer::~Viewer() {
  if (renderer_) (void)renderer_->wait();
}

Status Viewer::update(std::shared_ptr<const Scene> scene) {
  return picture_.update(std::move(scene)) ? renderer_->set_volumes(picture_.volumes()) : Nothing{};
}

Status Viewer::start(const SceneMoment& moment, int64_t display_ns, std::span<const Eye> eyes,
                     PictureSize size, const HostImages* images) {
  shown_ = picture_.at(moment, display_ns, eyes[0]);
  return images ? renderer_->start(shown_, eyes, size, *images)
                : renderer_->start(shown_, eyes, size);
}

}  // namespace palpate
