#pragma once

#include <string>
#include <vector>

#include "integration/app/outputs.h"
#include "integration/charts/felt_page.h"
#include "module/session/gallery.h"

namespace palpate::app {

/// A picture in the format of charts, opaque.
charts::Bitmap raster_of(const Picture& picture);

/// Stages view_1.png, ... and page.png, with what was seen and felt. Errors: kBadOutput.
Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const std::string& title, const charts::Timeline& timeline);

}  // namespace palpate::app
