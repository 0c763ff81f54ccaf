// Pictures of a session, into the host's images or into memory.
#include <algorithm>
#include <array>
#include <cmath>

#include "integration/toolkit/options.h"
#include "integration/toolkit/session_content.h"
#include "module/session/viewer.h"

namespace palpate::toolkit {

/// The content of a PalView.
class ViewContent {
 public:
  std::shared_ptr<SessionContent> of_session;
  std::unique_ptr<Viewer> viewer;
  PictureSize size;  ///< of the last picture
  int eyes = 0;      ///< number of eyes in it; 0: there is no picture
};

namespace {

PalResult open_view(PalSession* session, const PalViewInfo* given, PalView** view) {
  const Use use(of(session));
  if (!use) return refused_handle("session");
  if (!view) return failed(PAL_BAD_INPUT, {"The argument that takes the view is NULL"});
  PalViewInfo info;
  if (const PalResult read = taken(given, offsetof(PalViewInfo, look), "PalViewInfo", info);
      read != PAL_OK)
    return read;
  constexpr uint32_t kFlags = PAL_VIEW_NO_HAND | PAL_VIEW_NO_BOX | PAL_VIEW_CUT_OPEN |
                              PAL_VIEW_NO_BACKGROUND | PAL_VIEW_NO_SHADOWS;
  if (const Status flags = check_flags("PalViewInfo", info.flags, kFlags); !flags)
    return failed(flags.error());
  if (!use->context()->device)
    return failed(PAL_NO_DEVICE,
                  {"The context has no device that computes, so there are no pictures"});
  constexpr uint32_t kMost = 16384;
  if (info.width > kMost || info.height > kMost || info.eye_count > 2)
    return failed(PAL_BAD_INPUT,
                  {"A picture has at most 16384 pixels along an edge, and two eyes"});
  ViewChoices choices;
  if (info.look) choices.look = info.look;
  if (const Status known = check_look(choices.look); !known) return failed(known.error());
  choices.hand = !(info.flags & PAL_VIEW_NO_HAND);
  choices.box = !(info.flags & PAL_VIEW_NO_BOX);
  choices.cut_open = (info.flags & PAL_VIEW_CUT_OPEN) != 0;
  if (info.flags & PAL_VIEW_NO_SHADOWS) choices.shadows = 0.0;
  if (info.flags & PAL_VIEW_NO_BACKGROUND) choices.background = PictureBackground::kNone;
  const PictureSize most{int(info.width), int(info.height)};
  auto viewer = Viewer::open(use->context()->device, choices,
                             {.most = most, .most_eyes = int(info.eye_count)});
  if (!viewer) return failed(viewer.error());
  auto content = std::make_shared<ViewContent>();
  content->of_session = use.shared();
  content->viewer = std::move(*viewer);
  if (const Status uploaded = content->viewer->update(use->session().scene()); !uploaded)
    return failed(uploaded.error());
  *view = reinterpret_cast<PalView*>(Handle<ViewContent>::make(std::move(content)));
  return PAL_OK;
}

/// kBadInput for an invalid eye.
Result<Eye> eye_of(const PalEye& given) {
  Eye eye;
  const double* const q = given.orientation;
  eye.position_m = {given.position_m[0], given.position_m[1], given.position_m[2]};
  eye.orientation = glm::dquat(q[3], q[0], q[1], q[2]);
  eye.tan_left = given.tan_left;
  eye.tan_right = given.tan_right;
  eye.tan_down = given.tan_down;
  eye.tan_up = given.tan_up;
  const double length = glm::length(eye.orientation);
  const glm::dvec3 x = eye.position_m;
  const bool sees = eye.tan_right > eye.tan_left && eye.tan_up > eye.tan_down &&
                    std::isfinite(eye.tan_right - eye.tan_left) &&
                    std::isfinite(eye.tan_up - eye.tan_down);
  if (!sees || !(std::abs(length - 1.0) < 1e-3) || !std::isfinite(x.x + x.y + x.z))
    return Error{ErrorKind::kBadInput,
                 "An eye needs a finite place, a unit quaternion, and angles of view from left to "
                 "right and from below to above"};
  eye.orientation = glm::normalize(eye.orientation);
  return eye;
}

HostImages images_of(const PalImages& given) {
  HostImages images;
  for (size_t e = 0; e < 2; ++e)
    images.eyes[e] = {reinterpret_cast<VkImage>(given.colour[e]), given.colour_layer[e],
                      reinterpret_cast<VkImage>(given.depth[e]), given.depth_layer[e]};
  images.colour_format = VkFormat(given.colour_format);
  images.depth_format = VkFormat(given.depth_format);
  images.colour_layout = VkImageLayout(given.colour_layout);
  images.depth_layout = VkImageLayout(given.depth_layout);
  images.inverse_depth_0 = given.inverse_depth_0;
  images.inverse_depth_1 = given.inverse_depth_1;
  images.writes_depth = given.writes_depth != 0;
  return images;
}

PalResult render(ViewContent& of_view, const PalEye* given_eyes, uint32_t eye_count,
                 PictureSize size, double ahead_s, const PalImages* given_images) {
  if (!given_eyes || eye_count < 1 || eye_count > 2)
    return failed(PAL_BAD_INPUT, {"A picture has one eye or two"});
  if (!std::isfinite(ahead_s))
    return failed(PAL_BAD_INPUT, {"The time of a picture is not finite"});
  std::array<Eye, 2> eyes;
  for (size_t e = 0; e < eye_count; ++e) {
    const auto eye = eye_of(given_eyes[e]);
    if (!eye) return failed(eye.error());
    eyes[e] = *eye;
  }
  PalImages host{};
  if (given_images)
    if (const PalResult read =
            taken(given_images, offsetof(PalImages, inverse_depth_0), "PalImages", host);
        read != PAL_OK)
      return read;
  SessionContent& of_session = *of_view.of_session;
  const SceneSnapshot snapshot = of_session.snapshot();
  if (snapshot.volume_count == 0)
    return failed(PAL_NOT_YET, {"There was no haptic frame yet, so nothing is known to be drawn"});
  if (const Status uploaded = of_view.viewer->update(of_session.session().scene()); !uploaded)
    return failed(uploaded.error());
  of_view.viewer->show(of_session.session().tubes());
  const HostImages images = images_of(host);
  const int64_t display_ns = snapshot.now_ns + int64_t(1e9 * std::clamp(ahead_s, -1.0, 1.0));
  const Status started = of_view.viewer->start(snapshot, display_ns, {eyes.data(), eye_count}, size,
                                               given_images ? &images : nullptr);
  if (!started) return failed(started.error());
  of_view.size = size;
  of_view.eyes = int(eye_count);
  return PAL_OK;
}

/// Runs `work` with the view of a handle.
template <class Work>
PalResult with(PalView* view, const Work& work) noexcept {
  return guarded([&] {
    const Use use(of(view));
    return use ? work(*use) : refused_handle("view");
  });
}

}  // namespace
}  // namespace palpate::toolkit

using namespace palpate::toolkit;

PalResult pal_view_open(PalSession* session, const PalViewInfo* info, PalView** view) {
  return guarded([&] { return open_view(session, info, view); });
}

PalResult pal_view_close(PalView** view) {
  return guarded([&] {
    closed(of(taken_out_of(view)));
    return PAL_OK;
  });
}

PalResult pal_view_render(PalView* view, const PalEye* eyes, uint32_t eye_count, uint32_t width,
                          uint32_t height, double ahead_s, const PalImages* images) {
  return with(view, [&](ViewContent& of_view) {
    return render(of_view, eyes, eye_count, {int(width), int(height)}, ahead_s, images);
  });
}

PalResult pal_view_wait(PalView* view) {
  return with(view, [](ViewContent& of_view) {
    const palpate::Status waited = of_view.viewer->renderer().wait();
    return waited ? PAL_OK : failed(waited.error());
  });
}

PalResult pal_view_read(PalView* view, uint32_t eye, uint32_t* rgba, float* depth_m) {
  return with(view, [&](ViewContent& of_view) {
    if (eye >= uint32_t(of_view.eyes))
      return failed(PAL_BAD_INPUT, {"This eye was not drawn: render first"});
    const auto picture = of_view.viewer->renderer().read_back(int(eye));
    if (!picture) return failed(picture.error());
    if (rgba) std::copy(picture->colours.begin(), picture->colours.end(), rgba);
    constexpr float kNear_m = float(palpate::RendererOptions{}.near_m);
    if (depth_m)
      std::transform(picture->depths.begin(), picture->depths.end(), depth_m,
                     [](float depth) { return depth > 0.0F ? kNear_m / depth : 0.0F; });
    return PAL_OK;
  });
}
