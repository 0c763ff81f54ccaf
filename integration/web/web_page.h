#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "compute/volume/grid.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// A page to scroll: one self-contained HTML file with frames that play, overlays, curves and
/// numbers. It needs no network and no server. NiiVue (BSD-2) draws the volumes with WebGL 2.
namespace palpate::web {

/// What a volume of a page is for. Frames come first and are always seen; one overlay at a time
/// lies over them; labels lie over both.
enum class VolumeRole { kFrames, kOverlay, kLabels };

/// A label of a segmentation, for VolumeRole::kLabels.
struct WebLabel {
  int value = 1;  ///< 1 to 255
  std::string name;
  glm::ivec3 color{255};  ///< 0 to 255 each
};

/// Frames of one volume as 8-bit codes: value = low + code (high - low) / 255 (labels: value =
/// code). Frame k of every volume belongs to frame k of the page; where a volume has fewer frames,
/// it is not seen in the later ones.
struct WebVolume {
  VolumeRole role = VolumeRole::kFrames;
  std::string title;     ///< "motion to the next frame"
  std::string unit;      ///< "mm"; empty: none
  std::string note;      ///< a sentence beside the colours; may be empty
  std::string colormap;  ///< a name that NiiVue knows, or "decrease-increase"
  double low = 0.0, high = 1.0;
  Grid grid;
  std::vector<std::vector<uint8_t>> frames;  ///< shape (nz, ny, nx) each
  std::vector<WebLabel> labels;
};

struct WebCurve {
  std::string name;
  std::vector<double> x, y;  ///< of one length; a y that is not finite interrupts the line
};

/// Curves over the same x.
struct WebPlot {
  std::string title;            ///< with the unit of y
  std::string x_label;          ///< with the unit
  bool from_zero = true;        ///< whether the axis of y begins at 0
  bool follows_frames = false;  ///< whether x is the frames' time, so that the seen one is marked
  std::vector<WebCurve> curves;
};

struct WebPage {
  std::string title, subtitle;
  std::string verdict;               ///< "ok", "suspect", "failed"; empty: not judged
  std::vector<std::string> reasons;  ///< of the verdict
  std::vector<std::string> frame_labels;
  std::vector<double> frame_times;  ///< of the frames, in the unit of the plots' x
  std::vector<double> play_times_s;
  double period_s = 1.0;  ///< after which playing begins again; above the last time
  std::vector<WebVolume> volumes;
  std::vector<WebPlot> plots;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name, value
};

/// Fills the page's frames: labels ("frame 3, 93 ms, 15 % of the cycle"), times in ms for sequences
/// shorter than 10 s, else in s, and the times at which they are played. times_s: of `count`
/// frames, or empty: not known, then assumed_times() are played and the unit is frames. cycle_s: 0:
/// no cycle. Returns the unit of frame_times.
std::string set_frames(WebPage& page, size_t count, const std::vector<double>& times_s,
                       double cycle_s);

/// Values as codes, rounded; values beyond the range are clamped, not finite ones become 0.
std::vector<uint8_t> codes_of(const std::vector<float>& values, double low, double high);

/// A page holds at most this many voxels of frames, and this many of each overlay.
inline constexpr double kMostFrameVoxels = 8e6, kMostOverlayVoxels = 1e6;

/// The grids that lead from `grid` to one on which `frames` volumes have at most `most` voxels:
/// each halves the axes whose spacing is the finest (up to a factor of 1.5). resampled() onto the
/// next one is the mean of 2 x 2 x 2 voxels. Empty if `grid` is coarse enough.
std::vector<Grid> page_grids(const Grid& grid, size_t frames, double most);

/// The volume on the last of page_grids(), step by step.
Volume reduced(Volume volume, const std::vector<Grid>& steps);

/// To be asked before long work: kBadOutput if the name does not end in .html, the file can not be
/// written, or palpate was built without NiiVue.
Status check_can_write_page(const std::filesystem::path& path);

/// Writes the page, whole or not at all. Errors as check_can_write_page(). Any thread.
Status write_web_page(const WebPage& page, const std::filesystem::path& path);

}  // namespace palpate::web
