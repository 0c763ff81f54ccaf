#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// Finds what lies outside of what was scanned: outside of the sector of an ultrasound probe, of a
/// circle of reconstruction, of a crop. There a file holds one value (0, or padding) in all frames,
/// which is no tissue.
///
/// It is what has in all frames the value that is most frequent on the faces of the grid, and lies
/// outside the convex hull of all other samples: dark tissue inside stays. None where that value is
/// on less than half of the faces (and on less than nine tenths of those across each of two axes,
/// as for a cylinder). None either where less than 93 % of the hull is left without what is
/// connected to the faces (when opened by 1.5 voxels), or where the hull goes over less than nine
/// tenths of the grid along an axis. That is an organ that was cut out, or a thing on black, whose
/// border is a true one.
class NoDataFinder {
 public:
  /// Takes the next frame; all have the same grid, of at least two samples along each axis.
  void add(const Volume& frame);

  /// The samples without data, and two samples more, where a border is blurred. Empty where there
  /// are none. Any time after the first frame. Uses one core; about a tenth of a second for two
  /// million samples.
  std::optional<Mask> found() const;

 private:
  Grid grid_;
  float value_ = 0.0F;             ///< most frequent on the faces of the first frame
  std::vector<uint8_t> constant_;  ///< has this value in all frames
};

/// The share of the samples that count, 0 to 1.
double share_of(const Mask& mask);

/// Replaces the samples that the mask counts by the values beside them, as if the data went on
/// there as they end: then nothing has a border where only the data have one. The mask has the
/// frame's grid; unchanged if it counts all.
void continue_into(Volume& frame, const Mask& no_data);

}  // namespace palpate
