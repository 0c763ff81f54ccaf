#include "integration/desktop/desktop_loop.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "integration/charts/frame_bar.h"
#include "integration/charts/slice_panel.h"
#include "integration/desktop/help.h"
#include "module/scene/drive.h"

namespace palpate::desktop {
namespace {

constexpr int kWidth = 1120, kHeight = 760;
constexpr double kLevelDrag = 1.0, kWidthDrag = 2.0;  // widths, and exponent, for such a drag
constexpr double kTurn = 3.0;                         // radians for a drag over the window's height
constexpr double kZoom = 0.90;                        // of the distance, per notch or key
constexpr double kNotch = 1.0 / 40.0;    // of the ball around the volumes, per notch of the wheel
constexpr double kSliceStep = 1.0 / 40;  // of the ball around the volumes, per key
constexpr double kScrubStep = 1.0 / 40;  // of the sequence
constexpr int kPlotWidth = 330, kPlotHeight = 160, kEdge = 14;
constexpr double kToldWork_j = 0.1;  // a scene that does as much work on the hand tells it
constexpr std::chrono::milliseconds kFrame{15};  // where the display does not make it wait

}  // namespace

Result<std::unique_ptr<DesktopLoop>> DesktopLoop::open(const std::string& scene_name,
                                                       const vulkan::ContextOptions& gpu,
                                                       const ViewChoices& view) {
  auto window = Window::open(fmt::format("palpate: {}", scene_name), kWidth, kHeight);
  if (!window) return window.error();
  return std::unique_ptr<DesktopLoop>(new DesktopLoop(std::move(*window), scene_name, gpu, view));
}

DesktopLoop::DesktopLoop(std::unique_ptr<Window> window, std::string scene_name,
                         const vulkan::ContextOptions& gpu, const ViewChoices& view)
    : window_(std::move(window)), scene_name_(std::move(scene_name)), gpu_(gpu), view_(view) {
  wait("is being read");
}

void DesktopLoop::wait(const std::string& doing) {
  // Data may take seconds to be read: nobody is to look at an empty window meanwhile.
  const double scale = window_->scale();
  note_ = draw_note(scene_name_, {doing}, scale);
  const int edge = int(kEdge * scale);
  const Overlay overlay{&note_, {edge, edge}};
  window_->poll();
  window_->show({}, {&overlay, 1});
}

void DesktopLoop::begin(Session& session, PositionSource* mouse) {
  session_ = &session;
  mouse_ = mouse;
  const auto felt = session.scene();
  ScenePicture picture(view_);
  picture.update(felt);
  SceneSnapshot start;
  for (size_t v = 0; v < picture.volumes().size(); ++v)
    start.volumes[v].world_from_volume =
        driven(felt->volumes[v].spec.drive, felt->volumes[v].spec.transform, 0.0);
  glm::dvec3 centre;
  picture.bounds(start, centre, ball_m_);
  first_camera_ = camera_before(centre, ball_m_);
  if (view_.from.azimuth_deg) first_camera_.azimuth = glm::radians(*view_.from.azimuth_deg);
  if (view_.from.elevation_deg)
    first_camera_.elevation =
        std::clamp(glm::radians(*view_.from.elevation_deg), -kSteepest, kSteepest);
  camera_ = first_camera_ = zoom(first_camera_, 1.0 / view_.from.zoom);
  if (mouse_) {
    const Eye from = eye();
    const glm::dvec3 towards = glm::normalize(from.position_m - centre);
    pointing_ = Pointing(centre + ball_m_ * towards);
  }
  window_->poll();  // what was done while nothing could be seen is not meant for the scene
  live_ = std::make_unique<LivePicture>(
      session, gpu_, view_.stereo.value_or(Stereo::kMono) == Stereo::kMono ? 1 : 2);
  slices_ = std::make_unique<LiveSlices>(session);
}

Eye DesktopLoop::eye() const {
  const PictureSize size = eye_size();
  return eye_of(camera_, size.height > 0 ? size : PictureSize{kWidth, kHeight});
}

PictureSize DesktopLoop::eye_size() const {
  PictureSize size = window_->size_px();
  if (is_side_by_side(view_.stereo.value_or(Stereo::kMono))) size.width /= 2;
  return size;
}

void DesktopLoop::frame(const TickOutput& tick, const std::string& note) {
  const auto start = std::chrono::steady_clock::now();
  Input input = window_->poll();
  // Side by side, each half of the window is the whole picture of an eye.
  if (is_side_by_side(view_.stereo.value_or(Stereo::kMono)))
    input.cursor.x = 2.0 * input.cursor.x + (input.cursor.x < 0.0 ? 1.0 : -1.0);
  drag_bar(input);
  for (const KeyPress& one : input.keys) press(one, input);
  steer(input);
  if (mouse_) move_probe(input);
  live_->want({eye(), eye_size(), camera_.distance_m, view_});
  ForceTap::Sample sample;
  while (tap_.take(sample)) plot_.add(1e-9 * double(sample.now_ns), sample.force_n);
  if (auto newest = live_->newest()) shown_ = std::move(newest);
  draw(tick, note);
  std::this_thread::sleep_until(start + kFrame);
}

void DesktopLoop::press(const KeyPress& press, const Input& input) {
  switch (press.key) {
    case KeyAction::kPlay:
      session_->toggle_play();
      break;
    case KeyAction::kBack:
    case KeyAction::kForward:
      if (shown_)
        session_->scrub(shown_->snapshot,
                        press.key == KeyAction::kForward ? kScrubStep : -kScrubStep);
      break;
    case KeyAction::kClip:
      view_.cut_open = !view_.cut_open;
      break;
    case KeyAction::kLook: {
      const std::vector<std::string> names = preset_names();
      view_.look = size_t(press.number) < names.size() ? names[size_t(press.number)] : "auto";
      view_.level_moved = 0.0;
      view_.width_factor = 1.0;
      break;
    }
    case KeyAction::kRecentre:
      if (mouse_)
        pointing_.recentre(
            eye(), input.cursor,
            camera_.target_m + ball_m_ * glm::normalize(eye().position_m - camera_.target_m));
      break;
    case KeyAction::kReset:
      camera_ = first_camera_;
      pointing_.keep(eye(), input.cursor);
      break;
    case KeyAction::kNearer:
    case KeyAction::kFurther:
      camera_ = zoom(camera_, press.key == KeyAction::kNearer ? kZoom : 1.0 / kZoom);
      pointing_.keep(eye(), input.cursor);
      break;
    case KeyAction::kTube:
      if (view_.hand) session_->release_tube();
      break;
    case KeyAction::kKeepTubes:
      if (view_.hand) session_->keep_tubes();
      break;
    case KeyAction::kClearTubes:
      if (view_.hand) session_->clear_tubes();
      break;
    case KeyAction::kSlices:
      view_.slices = !view_.slices;
      break;
    case KeyAction::kSlicesAway:
    case KeyAction::kSlicesNear:
      view_.slices_moved_m += kSliceStep * ball_m_ *
                              (press.key == KeyAction::kSlicesAway ? 1.0 : -1.0) *
                              (eye().orientation * glm::dvec3(0.0, 0.0, -1.0));
      break;
    case KeyAction::kHelp:
      shows_help_ = !shows_help_;
      break;
    case KeyAction::kQuit:
      break;  // the window closes by itself
  }
}

/// A press on the bar of frames moves time until the button is released; then it goes on if it did.
/// Meanwhile the button means nothing else.
void DesktopLoop::drag_bar(Input& input) {
  const bool pressed = input.left && !was_left_;
  was_left_ = input.left;
  const glm::dvec2 at = input.cursor_px - glm::dvec2(bar_corner_);
  const bool is_over = at.x >= 0.0 && at.y >= 0.0 && at.x < bar_.width && at.y < bar_.height;
  if (pressed && is_over) {
    drags_bar_ = true;
    played_ = session_->plays();
    dragged_to_ = -1.0;
  }
  if (!drags_bar_) return;
  if (!input.left) {
    drags_bar_ = false;
    if (played_) session_->play(true);
    return;
  }
  const double share = charts::frame_bar_share(at.x, bar_.width, window_->scale());
  if (share != dragged_to_) session_->scrub_to(share);
  dragged_to_ = share;
  input.left = false;
}

/// The right button turns the view, and every button where the mouse is no hand.
void DesktopLoop::steer(const Input& input) {
  if (input.middle) {
    // As in viewers of slices: up shows more of what is dark, to the right is softer.
    view_.level_moved -= kLevelDrag * input.dragged.y;
    view_.width_factor =
        std::clamp(view_.width_factor * std::exp(kWidthDrag * input.dragged.x), 0.01, 100.0);
  }
  const bool turns = input.right || (!mouse_ && input.left);
  const double notches = turns || !mouse_ ? input.wheel : 0.0;
  if (!turns && notches == 0.0) return;
  // The picture follows the hand: what is dragged to the right is seen from further left.
  if (turns) camera_ = orbit(camera_, -kTurn * input.dragged.x, -kTurn * input.dragged.y);
  camera_ = zoom(camera_, std::pow(kZoom, notches));
  pointing_.keep(eye(), input.cursor);
}

void DesktopLoop::move_probe(const Input& input) {
  const Eye from = eye();
  const auto felt = session_->scene();
  const Transform& device = felt->world_from_device;
  if (input.in_window && !input.right && (input.moved || input.wheel != 0.0)) {
    const double reach_m = mouse_->info().workspace_radius_m * device.scale.x;
    const double middle_m = depth_of(from, device.translation_m);
    const Pointing::Depths depths{std::max(0.01, middle_m - reach_m),
                                  std::max(0.02, middle_m + reach_m)};
    pointing_.point(from, input.cursor, kNotch * ball_m_ * input.wheel, depths);
  }
  mouse_->hold(device.volume_from_world(pointing_.place_m()), input.left ? 1 : 0);
}

void DesktopLoop::draw_time() {
  bar_ = chart_ = {};
  if (!shown_) return;
  const auto scene = session_->scene();
  const int v = charts::first_moving(*scene, shown_->snapshot.volume_count);
  const double scale = window_->scale();
  const PictureSize size = window_->size_px();
  const int edge = int(kEdge * scale), width = size.width - 2 * edge;
  if (v < 0 || width < charts::kNarrowestWithBar_px * scale) return;
  const auto& volume = scene->volumes[size_t(v)].data;
  const double time_s = shown_->snapshot.volumes[size_t(v)].time_s;
  const auto lines = charts::time_lines(*scene, shown_->snapshot);
  bar_ = charts::draw_frame_bar({volume->times, time_s, fmt::format("{}", fmt::join(lines, ", "))},
                                width, scale);
  bar_corner_ = {edge, size.height - bar_.height - edge};
  sizes_.want(volume);
  const auto sizes = sizes_.newest();
  if (sizes && charts::has_sizes(*sizes))
    chart_ = charts::draw_sizes(*sizes, volume->times, time_s,
                                glm::ivec2(scale * glm::dvec2(kPlotWidth, kPlotHeight)), scale);
}

void DesktopLoop::draw_panel(int height_px) {
  if (!view_.slices || !shown_ || height_px < charts::kLowestWithSlices_px) {
    drawn_slices_ = nullptr;
    panel_ = {};
    return;
  }
  slices_->want({shown_->snapshot, view_, charts::slice_edge_px(height_px)});
  auto newest = slices_->newest();
  const std::vector<TubeColours>& colours = shown_->tube_colours;
  if (newest == drawn_slices_ && panel_.height == height_px && colours == drawn_colours_) return;
  drawn_slices_ = std::move(newest);
  drawn_colours_ = colours;
  panel_ = drawn_slices_ ? charts::draw_slices({*drawn_slices_, {}, colours}, height_px)
                         : charts::Bitmap{};
}

void DesktopLoop::draw(const TickOutput& tick, const std::string& note) {
  const double scale = window_->scale();
  if (scale != help_scale_) help_ = draw_help(scale, mouse_ != nullptr, view_.hand);
  std::vector<std::string> lines;
  const std::string trouble = live_->trouble();
  if (!trouble.empty()) lines.push_back("There is no picture: " + trouble);
  if (trouble.empty() && !shown_) lines.push_back("The first picture is being drawn.");
  draw_time();
  if (shown_ && bar_.width == 0)
    for (const std::string& line : charts::time_lines(*session_->scene(), shown_->snapshot))
      lines.push_back(line);
  if (!note.empty()) lines.push_back(note);
  if (view_.look != "auto") lines.push_back("look: " + view_.look);
  if (view_.hand && tick.cause != Cause::kNone) lines.push_back(sentence(tick.cause));
  if (view_.hand && tick.hand_work_j >= kToldWork_j)
    lines.push_back(fmt::format("work on the hand: {:.1f} J", tick.hand_work_j));
  const std::string text = fmt::format("{}", fmt::join(lines, "\n"));
  if (text != note_text_ || scale != help_scale_) note_ = draw_note(scene_name_, lines, scale);
  note_text_ = text;
  help_scale_ = scale;

  const PictureSize size = window_->size_px();
  const int edge = int(kEdge * scale);
  const int plot_width = std::min(kPlotWidth, int((size.width - 2 * edge) / scale));
  const charts::Bitmap strip = plot_.draw(std::max(1, plot_width), kPlotHeight, scale);
  const int bottom = bar_.width > 0 ? bar_corner_.y : size.height;
  OverlayCorners corners;
  corners.plot = {size.width - strip.width - edge, bottom - strip.height - edge};
  std::vector<Overlay> overlays = {{&note_, {edge, edge}}};
  if (bar_.width > 0) overlays.push_back({&bar_, bar_corner_});
  if (shows_help_) {
    const glm::ivec2 plot = view_.hand ? glm::ivec2(strip.width, strip.height) : glm::ivec2(0);
    corners = place_corners({size.width, bottom}, {help_.width, help_.height}, plot,
                            note_.height + 2 * edge, edge);
    overlays.push_back({&help_, corners.help});
  }
  const bool shows_plot = view_.hand && corners.shows_plot;
  if (shows_plot) overlays.push_back({&strip, corners.plot});
  // The segments' sizes at the left of the plot, or in its place.
  const glm::ivec2 chart((shows_plot ? corners.plot.x : size.width) - chart_.width - edge,
                         bottom - chart_.height - edge);
  const int help_end = shows_help_ && corners.help.y + help_.height > chart.y
                           ? corners.help.x + help_.width + edge
                           : edge;
  const bool shows_chart = chart_.width > 0 && chart.x >= help_end && chart.y > note_.height + edge;
  if (shows_chart) overlays.push_back({&chart_, chart});
  // Slices at the right, above both.
  const int below = shows_plot ? corners.plot.y : shows_chart ? chart.y : bottom;
  draw_panel(below - 2 * edge);
  const bool shows_panel = panel_.width > 0 && 3 * panel_.width <= size.width;
  if (shows_panel) overlays.push_back({&panel_, {size.width - panel_.width - edge, edge}});
  const charts::Bitmap bars = shown_ && !shows_panel
                                  ? charts::draw_tube_colours(shown_->tube_colours, size.height)
                                  : charts::Bitmap{};
  if (bars.width > 0) overlays.push_back({&bars, {size.width - bars.width - edge, edge}});
  static const Picture kNothing;
  window_->show(shown_ ? *shown_->picture : kNothing, overlays);
}

}  // namespace palpate::desktop
