#pragma once

#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "module/view/volume_renderer.h"
#include "tests/lab/studies/view_case.h"

/// Pictures of the heart phantom, drawn and timed.
namespace palpate::studies {

/// Frames 1 and 2 of the heart of size^3 voxels with their true motion, not cyclic.
std::shared_ptr<const MovingVolume> beating(int size);

/// One way of drawing.
struct Shot {
  Look look;
  double samples_per_voxel = 1.0;
  int pixels = kViewSize.width;
  std::vector<Eye> eyes = both_view_eyes();
  bool skip_empty = true;
  /// As by default; off: the same rate everywhere.
  bool refines = false;
  double smooth = RendererOptions{}.smooth;
  /// Each picture at another phase.
  bool moving = false;
  /// Counts samples, which takes time.
  bool counts = false;
};

struct Drawn {
  double seconds = 0.0;              ///< median
  std::vector<unsigned char> bytes;  ///< RGB of all eyes
  ViewStatistics statistics;
};

/// Draws until memory is warm, then `runs` times more with time measurement. Ends early after a
/// request by `stop`. Throws Mismatch, vulkan::Failure.
Drawn draw(const std::shared_ptr<vulkan::Context>& context,
           const std::shared_ptr<const MovingVolume>& volume, const Shot& shot, int runs,
           const std::stop_token& stop = {});

/// Seconds, medians, of pictures at a new phase each, and of the same picture repeated:
/// alternating, so that other load affects both equally.
std::pair<double, double> moving_and_still(const std::shared_ptr<vulkan::Context>& context,
                                           const std::shared_ptr<const MovingVolume>& volume,
                                           const Look& look, int runs);

}  // namespace palpate::studies
