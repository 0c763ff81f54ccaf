#pragma once

#include <array>
#include <cstdint>

#include "module/view/picture.h"

namespace palpate {

/// How the pictures of two eyes are put together. Everywhere else the left eye comes first.
enum class Stereo : uint8_t {
  kMono,      ///< one eye between both
  kParallel,  ///< side by side, the left eye's at the left: for viewers, or eyes that look ahead
  kCrossed,   ///< side by side, the left eye's at the right: for eyes that are crossed
  kAnaglyph,  ///< for red and cyan glasses, red at the left eye
};

/// Whether the eyes stand side by side.
inline bool is_side_by_side(Stereo stereo) {
  return stereo == Stereo::kParallel || stereo == Stereo::kCrossed;
}

/// One picture of the left and the right eye's, which have the same size; kMono: the left one.
/// Depths are those of the left eye for kAnaglyph, of both side by side else.
/// kAnaglyph: the projection of Dubois (Proc. ICASSP 2001) in linear light, so that colours stay as
/// near as glasses allow.
Picture joined(const std::array<Picture, 2>& eyes, Stereo stereo);

}  // namespace palpate
