#include "integration/app/picture_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "integration/charts/slice_panel.h"

namespace palpate::app {

charts::Bitmap raster_of(const Picture& picture) {
  charts::Bitmap raster{picture.width, picture.height, {}};
  raster.pixels.reserve(picture.colours.size());
  // From R in the lowest byte to 0xRRGGBB order, opaque.
  for (const uint32_t c : picture.colours)
    raster.pixels.push_back(0xff000000u | (c & 0xffu) << 16 | (c & 0xff00u) | (c >> 16 & 0xffu));
  return raster;
}

std::optional<charts::Bitmap> slices_beside(const ScenePicture& picture,
                                            const SceneSnapshot& snapshot, int height_px) {
  if (height_px < charts::kLowestWithSlices_px) return {};
  auto slices = picture.slices(snapshot, charts::slice_edge_px(height_px));
  if (!slices) return {};
  const auto lines = charts::time_lines(picture.volumes().front()->times, slices->time_s);
  return charts::draw_slices({std::move(*slices), lines}, height_px);
}

Status write_side_by_side(const std::string& path, const std::vector<charts::Bitmap>& rasters) {
  int width = 0, height = 0;
  for (const charts::Bitmap& raster : rasters) {
    width += raster.width;
    height = std::max(height, raster.height);
  }
  charts::Canvas canvas(width, height, charts::Color{});
  double left = 0.0;
  for (const charts::Bitmap& raster : rasters) {
    canvas.draw_raster(raster, {left, 0.0}, 0.0);
    left += raster.width;
  }
  return canvas.save(path);
}

Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const ScenePicture* of_slices, const std::string& title,
                   const charts::Timeline& timeline) {
  charts::FeltPage page{title, timeline.subtitle, {}, timeline};
  for (const StereoPicture& picture : pictures)
    page.views.push_back({raster_of(picture.eyes[0]), raster_of(picture.eyes[1]),
                          fmt::format("frame {:.2f}", picture.frame),
                          fmt::format("{:.2f} N", picture.force_n)});
  for (size_t v = 0; v < page.views.size(); ++v) {
    const auto path = outputs.stage(fmt::format("view_{}.png", v + 1));
    if (!path) return path.error();
    std::vector<charts::Bitmap> rasters{page.views[v].left, page.views[v].right};
    if (of_slices)
      if (auto slices = slices_beside(*of_slices, pictures[v].snapshot, rasters.front().height))
        rasters.push_back(std::move(*slices));
    const Status written = write_side_by_side(path->string(), rasters);
    if (!written) return outputs.in_place(written.error());
  }
  const auto path = outputs.stage("page.png");
  if (!path) return path.error();
  const Status written = charts::write_felt_page(path->string(), page);
  return written ? written : Status(outputs.in_place(written.error()));
}

}  // namespace palpate::app
