#include "module/xr/volume_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace palpate::xr {
namespace {

constexpr double kShare = 0.7;  // of the display's period: the runtime needs the rest
constexpr double kRaysAtLeast = 0.25;
// of the width and height: so a slow device too shows its first picture soon
constexpr double kAtFirst = 0.5;
constexpr double kUsualPeriod_s = 1.0 / 90.0;
// Share of the full pixels with which a picture is good enough for a higher rate: a judgement.
constexpr double kGoodPixels = 0.5;
constexpr size_t kMeasured = 30;  // pictures, after which it is known what they need

/// Whether the optics hide any of the frame's pixels.
bool hides(const HeadsetFrame& frame) {
  return !frame.eyes[0].hidden->triangles.empty() || !frame.eyes[1].hidden->triangles.empty();
}

}  // namespace

palpate::Eye eye_of(const EyeView& eye) {
  palpate::Eye view;
  view.position_m = eye.world_from_eye.position_m;
  view.orientation = eye.world_from_eye.rotation;
  view.tan_left = std::tan(eye.fov.left);
  view.tan_right = std::tan(eye.fov.right);
  view.tan_down = std::tan(eye.fov.down);
  view.tan_up = std::tan(eye.fov.up);
  return view;
}

Status VolumeSource::use(const std::shared_ptr<vulkan::Context>& context) {
  drop();
  context_ = context;
  return Nothing{};
}

void VolumeSource::drop() noexcept {
  if (making_.valid()) making_.wait();
  making_ = {};
  drawing_.reset();
  volumes_.clear();
  context_.reset();
  panel_.reset();
  resolution_ = {.scale = kAtFirst};
  unmeasured_ = false;
  needs_s_.clear();
  needed_s_ = 0.0;
}

VolumeSource::DrawingResult VolumeSource::make(const std::shared_ptr<vulkan::Context>& context,
                                               const Wanted& wanted) {
  auto drawing = std::make_unique<Drawing>();
  auto renderer = VolumeRenderer::make(context, {.most = wanted.most});
  if (!renderer) return renderer.error();
  drawing->renderer = std::move(*renderer);
  const Status set = drawing->renderer->set_volumes(wanted.volumes);
  if (!set) return set.error();
  // An error of the scene is reported by the frame that asks for it.
  const Status prepared = drawing->renderer->prepare(wanted.scene, wanted.eyes, wanted.masked);
  if (!prepared && prepared.error().kind != ErrorKind::kBadInput) return prepared.error();
  if (Repacker::needless(wanted.format)) return drawing;
  auto repacker = Repacker::make(context, wanted.format, wanted.most);
  if (!repacker) return repacker.error();
  drawing->repacker = std::move(*repacker);
  return drawing;
}

void VolumeSource::start_making(Wanted wanted) {
  drawing_.reset();
  unmeasured_ = false;
  most_ = wanted.most;
  format_ = wanted.format;
  volumes_ = wanted.volumes;
  making_ = std::async(std::launch::async, [context = context_, wanted = std::move(wanted)]() {
    return make(context, wanted);
  });
}

Result<bool> VolumeSource::prepare(const Scenery& scenery, const HeadsetFrame& frame,
                                   PictureSize most) {
  if (making_.valid()) {
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    DrawingResult made = making_.get();
    if (!made) return made.error();
    drawing_ = std::move(*made);
  }
  const VkFormat format = frame.color.format;
  if (!drawing_ || format != format_ || most.width > most_.width || most.height > most_.height) {
    start_making({most,
                  format,
                  {scenery.volumes.begin(), scenery.volumes.end()},
                  scenery.scene,
                  {eye_of(frame.eyes[0]), eye_of(frame.eyes[1])},
                  hides(frame)});
    return false;
  }
  if (std::equal(volumes_.begin(), volumes_.end(), scenery.volumes.begin(), scenery.volumes.end()))
    return true;
  // Additions to known volumes, such as a step of motion, are small.
  const Status set = drawing_->renderer->set_volumes(scenery.volumes);
  if (!set) return set.error();
  volumes_.assign(scenery.volumes.begin(), scenery.volumes.end());
  return true;
}

Result<Drawn> VolumeSource::record(const HeadsetFrame& frame, VkCommandBuffer commands) {
  trouble_.clear();
  const auto scenery = show_(frame);
  panel_ = scenery ? scenery->panel : std::nullopt;
  if (!scenery || scenery->volumes.empty()) return Drawn{};
  PictureSize full{int(frame.eyes[0].size.width), int(frame.eyes[0].size.height)};
  full.width = std::min(full.width, int(frame.eyes[1].size.width));
  full.height = std::min(full.height, int(frame.eyes[1].size.height));
  const double period_s = frame.period_ns > 0 ? 1e-9 * double(frame.period_ns) : kUsualPeriod_s;
  if (drawing_ && unmeasured_) {
    // The commands of the frame before have ended: now it is known what they took.
    const VolumeRenderer::Times took = drawing_->renderer->times();
    picture_s_ = took.update_s + took.rays_s;
    unmeasured_ = false;
    // Fewer pixels make casting rays cheaper, but not bringing volumes to their phase.
    note_need(took.update_s, took.rays_s, full);
    const double left_s = std::max(kShare * period_s - took.update_s, kRaysAtLeast * period_s);
    resolution_ = next_resolution(resolution_, took.rays_s, {.budget_s = left_s});
  }
  const Result<bool> ready = prepare(*scenery, frame, full);
  if (!ready) return ready.error();
  if (!*ready) return Drawn{};
  const PictureSize wanted = scaled(full, resolution_.scale);
  size_ = {std::min(wanted.width, full.width), std::min(wanted.height, full.height)};
  const std::array<palpate::Eye, 2> eyes{eye_of(frame.eyes[0]), eye_of(frame.eyes[1])};
  const Status started =
      drawing_->renderer->start(scenery->scene, eyes, size_, visible_of(frame, eyes));
  if (!started && started.error().kind == ErrorKind::kBadInput) {
    trouble_ = started.error().message;
    return Drawn{};
  }
  if (!started) return started.error();
  unmeasured_ = true;
  if (drawing_->repacker) {
    const Status repacked = drawing_->repacker->start(drawing_->renderer->colour(), size_);
    if (!repacked) return repacked.error();
  }
  return copy(frame, commands);
}

/// What a picture of good quality takes on the device, from one of the size drawn last.
void VolumeSource::note_need(double update_s, double rays_s, PictureSize full) {
  if (needed_s_ > 0.0) return;
  const double drawn = double(size_.width) * size_.height / (double(full.width) * full.height);
  needs_s_.push_back((update_s + kGoodPixels * rays_s / drawn) / kShare);
  if (needs_s_.size() < kMeasured) return;
  const auto middle = needs_s_.begin() + kMeasured / 2;
  std::nth_element(needs_s_.begin(), middle, needs_s_.end());
  needed_s_ = *middle;
}

std::shared_ptr<const VisiblePixels> VolumeSource::visible_of(
    const HeadsetFrame& frame, const std::array<palpate::Eye, 2>& eyes) {
  if (!hides(frame)) return nullptr;
  bool same = mask_.visible && mask_.visible->size.width == size_.width &&
              mask_.visible->size.height == size_.height;
  std::array<HiddenTriangles, 2> hidden;
  for (size_t e = 0; e < 2; ++e) {
    const HiddenMesh& mesh = *frame.eyes[e].hidden;
    const palpate::Eye& eye = eyes[e];
    const glm::dvec4 tangents(eye.tan_left, eye.tan_right, eye.tan_down, eye.tan_up);
    same = same && mask_.tangents[e] == tangents && mask_.hidden[e] == mesh;
    mask_.tangents[e] = tangents;
    if (!same) mask_.hidden[e] = mesh;
    hidden[e] = {mesh.vertices, mesh.triangles};
  }
  if (!same)
    mask_.visible = std::make_shared<const VisiblePixels>(visible_pixels(eyes, hidden, size_));
  return mask_.visible;
}

/// The eyes lie one after the other in the renderer's buffers, as layers do in a copy.
Drawn VolumeSource::copy(const HeadsetFrame& frame, VkCommandBuffer commands) const {
  VkMemoryBarrier drawn_before{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  drawn_before.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  drawn_before.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                       VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &drawn_before, 0, nullptr, 0, nullptr);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 2};
  region.imageExtent = {uint32_t(size_.width), uint32_t(size_.height), 1};
  const vulkan::Buffer& colours =
      drawing_->repacker ? drawing_->repacker->repacked() : drawing_->renderer->colour();
  vkCmdCopyBufferToImage(commands, colours.handle(), frame.color.image,
                         VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  Drawn drawn;
  drawn.color = true;
  drawn.size = {uint32_t(size_.width), uint32_t(size_.height)};
  if (!frame.depth.image) return drawn;
  region.imageSubresource.aspectMask = VK_IMAGE_ASPECT_DEPTH_BIT;
  vkCmdCopyBufferToImage(commands, drawing_->renderer->depth().handle(), frame.depth.image,
                         VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  drawn.depth = true;
  // Reversed and without end: 1 at the nearest, 0 at infinity.
  drawn.depth_0_m = std::numeric_limits<float>::infinity();
  drawn.depth_1_m = float(RendererOptions{}.near_m);
  return drawn;
}

}  // namespace palpate::xr
