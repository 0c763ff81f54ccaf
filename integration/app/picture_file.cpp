#include "integration/app/picture_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "integration/charts/frame_bar.h"
#include "integration/charts/slice_panel.h"

namespace palpate::app {

namespace {

/// From R in the lowest byte to 0xAARRGGBB.
uint32_t argb_of(uint32_t colour) {
  return (colour & 0xff00ff00U) | (colour & 0xffU) << 16 | (colour >> 16 & 0xffU);
}

/// The light of a pixel on black as a colour that is multiplied by its coverage as charts do it:
/// by the encoded value.
uint32_t as_transparent(uint32_t colour) {
  const uint32_t coverage = colour >> 24;
  if (coverage == 0) return 0;
  const uint32_t alone = colour_of(light_of(colour) * (255.0F / float(coverage)));
  uint32_t result = coverage << 24;
  for (int shift = 0; shift < 24; shift += 8)
    result |= ((alone >> shift & 0xffU) * coverage + 127) / 255 << shift;
  return argb_of(result);
}

constexpr double kUsualPicture_px = 768.0, kLeastStripScale = 0.7, kSizesHeight = 130.0;
constexpr charts::Color kStripGround{0.055, 0.065, 0.085};
constexpr double kNameHeight = 26.0;  // of the line below the pictures of two eyes, px

}  // namespace

charts::Bitmap raster_of(const Picture& picture, PictureBackground background) {
  charts::Bitmap raster{picture.width, picture.height, {}};
  raster.pixels.reserve(picture.colours.size());
  for (const uint32_t c : picture.colours)
    raster.pixels.push_back(background == PictureBackground::kNone ? as_transparent(c)
                                                                   : argb_of(c | 0xff000000U));
  return raster;
}

std::vector<charts::Bitmap> rasters_of(std::span<const Picture> eyes, const ViewChoices& choices) {
  if (eyes.size() == 1) return {raster_of(eyes[0], choices.background)};
  const Stereo stereo = choices.stereo.value_or(Stereo::kParallel);
  if (!is_side_by_side(stereo))
    return {raster_of(joined({eyes[0], eyes[1]}, stereo), choices.background)};
  std::vector<charts::Bitmap> rasters;
  for (size_t place = 0; place < 2; ++place) {
    const size_t eye = stereo == Stereo::kParallel ? place : 1 - place;
    const charts::Bitmap raster = raster_of(eyes[eye], choices.background);
    charts::Canvas canvas(raster.width, raster.height + int(kNameHeight));
    canvas.draw_raster(raster, {0.0, 0.0}, 0.0);
    canvas.fill_box({0.0, raster.height}, {raster.width, kNameHeight}, {1.0, 1.0, 1.0});
    canvas.draw_text(eye == 0 ? "left eye" : "right eye",
                     {0.5 * raster.width, raster.height + 0.7 * kNameHeight},
                     {.size_px = 14, .align = charts::Align::kCentre});
    rasters.push_back(canvas.raster());
  }
  return rasters;
}

std::optional<charts::Bitmap> slices_beside(const ScenePicture& picture,
                                            const SceneSnapshot& snapshot,
                                            const std::vector<TubeColours>& colours,
                                            int height_px) {
  if (height_px < charts::kLowestWithSlices_px) return {};
  auto slices = picture.slices(snapshot, charts::slice_edge_px(height_px));
  if (!slices) return {};
  const auto lines = charts::time_lines(picture.volumes().front()->times, slices->time_s);
  return charts::draw_slices({std::move(*slices), lines, colours}, height_px);
}

namespace {

/// Draws them into a canvas that `use` is then given.
template <class Use>
auto on_canvas(const std::vector<charts::Bitmap>& rasters, const Use& use) {
  int width = 0, height = 0;
  for (const charts::Bitmap& raster : rasters) {
    width += raster.width;
    height = std::max(height, raster.height);
  }
  charts::Canvas canvas(width, height);
  double left = 0.0;
  for (const charts::Bitmap& raster : rasters) {
    canvas.draw_raster(raster, {left, 0.0}, 0.0);
    left += raster.width;
  }
  return use(canvas);
}

}  // namespace

charts::Bitmap side_by_side(const std::vector<charts::Bitmap>& rasters) {
  return on_canvas(rasters, [](const charts::Canvas& canvas) { return canvas.raster(); });
}

Status write_side_by_side(const std::string& path, const std::vector<charts::Bitmap>& rasters) {
  return on_canvas(rasters, [&](const charts::Canvas& canvas) { return canvas.save(path); });
}

TimeStrip::TimeStrip(std::shared_ptr<const Scene> scene, bool has_bar, bool says_time)
    : scene_(std::move(scene)),
      has_bar_(has_bar),
      says_time_(says_time),
      volume_(charts::first_moving(*scene_)) {
  if (volume_ >= 0) sizes_ = segment_sizes(*scene_->volumes[size_t(volume_)].data);
}

charts::Bitmap TimeStrip::below(charts::Bitmap picture, const SceneSnapshot& snapshot,
                                int height_px) const {
  const double scale = std::max(height_px / kUsualPicture_px, kLeastStripScale);
  if (volume_ < 0 || picture.width < charts::kNarrowestWithBar_px) return picture;
  const FrameTimes& times = scene_->volumes[size_t(volume_)].data->times;
  const double time_s = snapshot.volumes[size_t(volume_)].time_s;
  std::vector<charts::Bitmap> parts;
  if (charts::has_sizes(sizes_))
    parts.push_back(charts::draw_sizes(sizes_, times, time_s,
                                       {picture.width, int(kSizesHeight * scale)}, scale));
  if (has_bar_) {
    charts::FrameBar bar{times, time_s, ""};
    if (says_time_)
      bar.text = fmt::format("{}", fmt::join(charts::time_lines(times, time_s), ", "));
    parts.push_back(charts::draw_frame_bar(bar, picture.width, scale));
  }
  int height = picture.height;
  for (const charts::Bitmap& part : parts) height += part.height;
  charts::Canvas canvas(picture.width, height);
  canvas.draw_raster(picture, {0.0, 0.0}, 0.0);
  double y = picture.height;
  canvas.fill_box({0.0, y}, {picture.width, height - y}, kStripGround);
  for (const charts::Bitmap& part : parts) {
    canvas.draw_raster(part, {0.0, y}, 0.0);
    y += part.height;
  }
  return canvas.raster();
}

Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const ScenePicture* of_slices, const TimeStrip& strip, const std::string& title,
                   const charts::Timeline& timeline, const ViewChoices& choices) {
  charts::FeltPage page{title, timeline.subtitle, {}, timeline};
  for (const StereoPicture& picture : pictures)
    page.views.push_back({raster_of(picture.eyes[0]), raster_of(picture.eyes[1]),
                          fmt::format("frame {:.2f}", picture.frame),
                          fmt::format("{:.2f} N", picture.force_n)});
  for (size_t v = 0; v < page.views.size(); ++v) {
    const auto path = outputs.stage(fmt::format("view_{}.png", v + 1));
    if (!path) return path.error();
    std::vector<charts::Bitmap> rasters = rasters_of(pictures[v].eyes, choices);
    if (of_slices)
      if (auto slices = slices_beside(*of_slices, pictures[v].snapshot, pictures[v].tube_colours,
                                      pictures[v].eyes[0].height))
        rasters.push_back(std::move(*slices));
    const Status written = write_side_by_side(
        path->string(),
        {strip.below(side_by_side(rasters), pictures[v].snapshot, pictures[v].eyes[0].height)});
    if (!written) return outputs.in_place(written.error());
  }
  const auto path = outputs.stage("page.png");
  if (!path) return path.error();
  const Status written = charts::write_felt_page(path->string(), page);
  return written ? written : Status(outputs.in_place(written.error()));
}

}  // namespace palpate::app
