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

/// Whether some pixels are not drawn: the optics hide them, or they are beyond a smaller view.
bool leaves_out(const HeadsetFrame& frame) {
  const VkExtent2D first = frame.eyes[0].size;
  return std::any_of(frame.eyes.begin(), frame.eyes.end(), [&](const EyeView& eye) {
    return !eye.hidden->triangles.empty() || eye.size.width != first.width ||
           eye.size.height != first.height;
  });
}

std::vector<palpate::Eye> eyes_of(const HeadsetFrame& frame) {
  std::vector<palpate::Eye> eyes;
  for (const EyeView& eye : frame.eyes) eyes.push_back(eye_of(eye));
  return eyes;
}

/// The size of a part of `of` that is in proportion as `eye` is to the frame's largest view.
PictureSize part_of(PictureSize of, VkExtent2D eye, PictureSize full) {
  const auto one = [](int most, uint32_t pixels, int all) {
    return std::clamp(int(std::lround(double(most) * pixels / all)), 1, most);
  };
  return {one(of.width, eye.width, full.width), one(of.height, eye.height, full.height)};
}

/// What hides the picture beyond a view's own tangents (left, right, down, up), in the view's plane
/// z = -1: the right part of the picture and the lower one, each as two triangles.
void hide_beyond(glm::dvec4 view, glm::dvec4 picture, HiddenMesh& mesh) {
  // Beyond the picture's edges, so that none of its pixels is left.
  constexpr double kOutside = 1.0;
  const auto rectangle = [&](double left, double right, double down, double up) {
    const auto first = uint32_t(mesh.vertices.size());
    for (const glm::dvec2 corner : {glm::dvec2(left, down), glm::dvec2(right, down),
                                    glm::dvec2(right, up), glm::dvec2(left, up)})
      mesh.vertices.emplace_back(corner);
    for (const uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.triangles.push_back(first + corner);
  };
  const double left = picture.x - kOutside, right = picture.y + kOutside;
  const double down = picture.z - kOutside, up = picture.w + kOutside;
  if (picture.y > view.y) rectangle(view.y, right, down, up);
  if (picture.z < view.z) rectangle(left, right, down, view.z);
}

bool equal(PictureSize a, PictureSize b) {
  return a.width == b.width && a.height == b.height;
}

glm::dvec4 tangents_of(const palpate::Eye& eye) {
  return {eye.tan_left, eye.tan_right, eye.tan_down, eye.tan_up};
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

palpate::Eye eye_of(const EyeView& eye, PictureSize part, PictureSize size) {
  palpate::Eye view = eye_of(eye);
  view.tan_right = view.tan_left + (view.tan_right - view.tan_left) * size.width / part.width;
  view.tan_down = view.tan_up - (view.tan_up - view.tan_down) * size.height / part.height;
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
  auto renderer =
      VolumeRenderer::make(context, {.most = wanted.most, .most_eyes = int(wanted.eyes.size())});
  if (!renderer) return renderer.error();
  drawing->renderer = std::move(*renderer);
  const Status set = drawing->renderer->set_volumes(wanted.volumes);
  if (!set) return set.error();
  // An error of the scene is reported by the frame that asks for it.
  const Status prepared = drawing->renderer->prepare(wanted.scene, wanted.eyes, wanted.masked);
  if (!prepared && prepared.error().kind != ErrorKind::kBadInput) return prepared.error();
  if (Repacker::needless(wanted.format)) return drawing;
  auto repacker = Repacker::make(context, wanted.format, wanted.most, int(wanted.eyes.size()));
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

Result<bool> VolumeSource::prepare(const Scenery& scenery, const HeadsetFrame& frame) {
  // As large as any view may become, such as one that no longer follows the gaze.
  const PictureSize most{int(frame.color.size.width), int(frame.color.size.height)};
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
                  eyes_of(frame),
                  leaves_out(frame)});
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
  PictureSize full;
  for (const EyeView& eye : frame.eyes) {
    full.width = std::max(full.width, int(eye.size.width));
    full.height = std::max(full.height, int(eye.size.height));
  }
  const double period_s = frame.period_ns > 0 ? 1e-9 * double(frame.period_ns) : kUsualPeriod_s;
  if (drawing_ && unmeasured_) {
    // The commands of the frame before have ended: now it is known what they took.
    const VolumeRenderer::Times took = drawing_->renderer->times();
    picture_s_ = took.update_s + took.rays_s;
    unmeasured_ = false;
    // Fewer pixels make casting rays cheaper, but not bringing volumes to their phase.
    note_need(took.update_s, took.rays_s,
              double(size_.width) * size_.height / (double(full.width) * full.height));
    const double left_s = std::max(kShare * period_s - took.update_s, kRaysAtLeast * period_s);
    resolution_ = next_resolution(resolution_, took.rays_s, {.budget_s = left_s});
  }
  const Result<bool> ready = prepare(*scenery, frame);
  if (!ready) return ready.error();
  if (!*ready) return Drawn{};
  const PictureSize wanted = scaled(full, resolution_.scale);
  size_ = {std::min(wanted.width, full.width), std::min(wanted.height, full.height)};
  std::vector<palpate::Eye> eyes;
  sizes_.clear();
  for (const EyeView& eye : frame.eyes) {
    sizes_.push_back(part_of(size_, eye.size, full));
    eyes.push_back(eye_of(eye, sizes_.back(), size_));
  }
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

/// What a picture of good quality takes on the device, from the last one, which had this share of
/// the full pixels.
void VolumeSource::note_need(double update_s, double rays_s, double share) {
  if (needed_s_ > 0.0) return;
  needs_s_.push_back((update_s + kGoodPixels * rays_s / share) / kShare);
  if (needs_s_.size() < kMeasured) return;
  const auto middle = needs_s_.begin() + kMeasured / 2;
  std::nth_element(needs_s_.begin(), middle, needs_s_.end());
  needed_s_ = *middle;
}

std::shared_ptr<const VisiblePixels> VolumeSource::visible_of(
    const HeadsetFrame& frame, const std::vector<palpate::Eye>& eyes) {
  if (!leaves_out(frame)) return nullptr;
  HiddenParts now;
  for (size_t e = 0; e < eyes.size(); ++e) {
    now.hidden.push_back(*frame.eyes[e].hidden);
    now.tangents.push_back(now.hidden[e].triangles.empty() ? glm::dvec4(0.0)
                                                           : tangents_of(eyes[e]));
  }
  now.sizes = sizes_;
  if (mask_.visible && equal(mask_.visible->size, size_) && mask_.hidden == now.hidden &&
      mask_.tangents == now.tangents &&
      std::equal(now.sizes.begin(), now.sizes.end(), mask_.sizes.begin(), mask_.sizes.end(), equal))
    return mask_.visible;
  std::vector<HiddenMesh> meshes = now.hidden;
  std::vector<HiddenTriangles> hidden;
  for (size_t e = 0; e < eyes.size(); ++e) {
    hide_beyond(tangents_of(eye_of(frame.eyes[e])), tangents_of(eyes[e]), meshes[e]);
    hidden.push_back({meshes[e].vertices, meshes[e].triangles});
  }
  now.visible = std::make_shared<const VisiblePixels>(visible_pixels(eyes, hidden, size_));
  mask_ = std::move(now);
  return mask_.visible;
}

/// The pictures of the eyes lie one after the other in the renderer's buffers, all of the same
/// size.
Drawn VolumeSource::copy(const HeadsetFrame& frame, VkCommandBuffer commands) const {
  VkMemoryBarrier drawn_before{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  drawn_before.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  drawn_before.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                       VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &drawn_before, 0, nullptr, 0, nullptr);
  // Of each picture the corner that is the view's own.
  const auto copy_to = [&](const Target& target, const vulkan::Buffer& from, uint64_t pixel_bytes,
                           VkImageAspectFlags aspect) {
    std::vector<VkBufferImageCopy> regions;
    for (size_t eye = 0; eye < sizes_.size(); ++eye) {
      VkBufferImageCopy& region = regions.emplace_back();
      region.bufferOffset = pixel_bytes * eye * uint64_t(size_.width) * uint64_t(size_.height);
      region.bufferRowLength = uint32_t(size_.width);
      region.bufferImageHeight = uint32_t(size_.height);
      region.imageSubresource = {aspect, 0, uint32_t(eye), 1};
      region.imageExtent = {uint32_t(sizes_[eye].width), uint32_t(sizes_[eye].height), 1};
    }
    vkCmdCopyBufferToImage(commands, from.handle(), target.image,
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, uint32_t(regions.size()),
                           regions.data());
  };
  if (drawing_->repacker)
    copy_to(frame.color, drawing_->repacker->repacked(), drawing_->repacker->pixel_bytes(),
            VK_IMAGE_ASPECT_COLOR_BIT);
  else
    copy_to(frame.color, drawing_->renderer->colour(), 4, VK_IMAGE_ASPECT_COLOR_BIT);
  Drawn drawn;
  drawn.color = true;
  for (const PictureSize& size : sizes_)
    drawn.sizes.push_back({uint32_t(size.width), uint32_t(size.height)});
  if (!frame.depth.image) return drawn;
  copy_to(frame.depth, drawing_->renderer->depth(), 4, VK_IMAGE_ASPECT_DEPTH_BIT);
  drawn.depth = true;
  // Reversed and without end: 1 at the nearest, 0 at infinity.
  drawn.depth_0_m = std::numeric_limits<float>::infinity();
  drawn.depth_1_m = float(RendererOptions{}.near_m);
  return drawn;
}

}  // namespace palpate::xr
