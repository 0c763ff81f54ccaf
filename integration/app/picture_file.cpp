#include "integration/app/picture_file.h"

#include <fmt/format.h>

namespace palpate::app {

charts::Bitmap raster_of(const Picture& picture) {
  charts::Bitmap raster{picture.width, picture.height, {}};
  raster.pixels.reserve(picture.colours.size());
  // From R in the lowest byte to 0xRRGGBB order, opaque.
  for (const uint32_t c : picture.colours)
    raster.pixels.push_back(0xff000000u | (c & 0xffu) << 16 | (c & 0xff00u) | (c >> 16 & 0xffu));
  return raster;
}

Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const std::string& title, const charts::Timeline& timeline) {
  charts::FeltPage page{title, timeline.subtitle, {}, timeline};
  for (const StereoPicture& picture : pictures)
    page.views.push_back({raster_of(picture.eyes[0]), raster_of(picture.eyes[1]),
                          fmt::format("frame {:.2f}", picture.frame),
                          fmt::format("{:.2f} N", picture.force_n)});
  for (size_t v = 0; v < page.views.size(); ++v) {
    const auto path = outputs.stage(fmt::format("view_{}.png", v + 1));
    if (!path) return path.error();
    const Status written = charts::write_stereo_view(path->string(), page.views[v]);
    if (!written) return outputs.in_place(written.error());
  }
  const auto path = outputs.stage("page.png");
  if (!path) return path.error();
  const Status written = charts::write_felt_page(path->string(), page);
  return written ? written : Status(outputs.in_place(written.error()));
}

}  // namespace palpate::app
