#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "integration/app/outputs.h"
#include "integration/charts/felt_page.h"
#include "module/session/gallery.h"
#include "module/session/scene_picture.h"

namespace palpate::app {

/// A picture in the format of charts: opaque, or with kNone as background as transparent as it is
/// covered.
charts::Bitmap raster_of(const Picture& picture,
                         PictureBackground background = PictureBackground::kDark);

/// The pictures of one or two eyes as they go to a file: side by side with a line below that names
/// the eyes, or joined. stereo: of two eyes; not set: kParallel.
std::vector<charts::Bitmap> rasters_of(std::span<const Picture> eyes, const ViewChoices& choices);

/// Slices of a scene's first visible volume as a panel beside a picture of this height: their place
/// in `snapshot`, with its time and the bars of the picture's tubes below. None without volumes,
/// and none beside a picture that is too low for it.
std::optional<charts::Bitmap> slices_beside(const ScenePicture& picture,
                                            const SceneSnapshot& snapshot,
                                            const std::vector<TubeColours>& colours, int height_px);

/// Pictures side by side, their tops at one height.
charts::Bitmap side_by_side(const std::vector<charts::Bitmap>& rasters);
/// Writes pictures side by side as PNG, their tops at one height. Errors: kBadOutput, kOutOfMemory.
Status write_side_by_side(const std::string& path, const std::vector<charts::Bitmap>& rasters);

/// Stages view_1.png, ... and page.png, with what was seen and felt. of_slices: of the scene, as it
/// was felt; null: no slices. Errors: kBadOutput.
Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const ScenePicture* of_slices, const std::string& title,
                   const charts::Timeline& timeline, const ViewChoices& choices);

}  // namespace palpate::app
