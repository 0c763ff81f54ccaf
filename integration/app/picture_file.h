#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "integration/app/outputs.h"
#include "integration/charts/felt_page.h"
#include "module/session/gallery.h"
#include "module/session/scene_picture.h"
#include "module/session/segment_sizes.h"

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

/// What stands below the pictures of a scene in files, of its first volume with several frames: how
/// large its segments are over its frames and at the time of the picture, and in films the bar of
/// frames. Immutable; one thread.
class TimeStrip {
 public:
  /// Measures the segments (segment_sizes()), where there are any. says_time: the bar has the time
  /// in words, for pictures without slices, whose panel has them.
  TimeStrip(std::shared_ptr<const Scene> scene, bool has_bar, bool says_time = false);
  /// The picture with the strip below it, as it is where there is nothing to show, or no room
  /// (charts::kNarrowestWithBar_px). height_px: of an eye's picture, to which text is in
  /// proportion.
  charts::Bitmap below(charts::Bitmap picture, const SceneSnapshot& snapshot, int height_px) const;

 private:
  std::shared_ptr<const Scene> scene_;
  bool has_bar_, says_time_;
  int volume_;
  SegmentSizes sizes_;
};

/// Pictures side by side, their tops at one height.
charts::Bitmap side_by_side(const std::vector<charts::Bitmap>& rasters);
/// Writes pictures side by side as PNG, their tops at one height. Errors: kBadOutput, kOutOfMemory.
Status write_side_by_side(const std::string& path, const std::vector<charts::Bitmap>& rasters);

/// Stages view_1.png, ... and page.png, with what was seen and felt. of_slices: of the scene, as it
/// was felt; null: no slices. Errors: kBadOutput.
Status stage_views(Outputs& outputs, const std::vector<StereoPicture>& pictures,
                   const ScenePicture* of_slices, const TimeStrip& strip, const std::string& title,
                   const charts::Timeline& timeline, const ViewChoices& choices);

}  // namespace palpate::app
