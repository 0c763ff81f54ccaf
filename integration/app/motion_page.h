#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "compute/motion/verdict.h"
#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "integration/web/web_page.h"

namespace palpate::app {

/// Collects what a page shows of a motion, frame by frame: reduced copies, so that long sequences
/// fit. One thread at a time.
class MotionPage {
 public:
  /// frames: how many will be added at most, all on this grid.
  MotionPage(const Grid& grid, size_t frames);

  /// The next frame, on the grid.
  void add_frame(const Volume& frame);
  /// The motion from the last added frame to the one after it, and its confidence; any grids.
  void add_step(const Field& field, const Confidence& confidence);

  /// Curves over the frames' times.
  struct FrameCurve {
    std::string title;  ///< of the plot: curves of one title share it
    std::string name;
    std::vector<double> y;  ///< one per frame; NaN: none
  };
  struct PageWords {
    std::string title, subtitle;
    const Verdict* verdict = nullptr;  ///< null: not judged
    std::vector<double> times_s;       ///< one per frame; empty: not known
    double cycle_s = 0.0;              ///< 0: no cycle
    std::vector<std::string> names;    ///< instead of numbers and times; empty: those
    std::vector<FrameCurve> curves;
    std::vector<std::pair<std::string, std::string>> facts;  ///< name, value
  };
  /// kBadOutput as web::write_web_page().
  Status write(const PageWords& words, const std::filesystem::path& path) const;

 private:
  std::vector<Grid> frame_steps_, overlay_steps_;
  Grid frame_grid_, overlay_grid_;
  std::vector<std::vector<float>> frames_, motion_mm_, confidence_, determinant_;
  std::vector<std::vector<float>> off_mm_;  ///< of the steps whose deviation is known
};

}  // namespace palpate::app
