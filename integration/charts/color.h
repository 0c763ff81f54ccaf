#pragma once

namespace palpate::charts {

/// A display colour, sRGB, each component in [0, 1].
struct Color {
  double r = 0;
  double g = 0;
  double b = 0;
};

/// What a colour map is used for. All maps are straight lines in CIE lightness, so that equal steps
/// of the number look like equal steps, in grey print too.
enum class ColorMap {
  kGray,        ///< frames: black to white
  kMotion,      ///< how far: dark violet over teal to yellow
  kError,       ///< how wrong: paper white over orange to dark plum
  kDifference,  ///< signed: blue below the middle, paper white in the middle, red above
  kConfidence,  ///< how sure: pale sand to deep teal
};

/// The colour at t in [0, 1] of a map; t outside is clamped, NaN is the low end. Any thread.
Color color_at(ColorMap map, double t);

/// A colour from CIE lightness [0, 100], chroma and hue in degrees; chroma is lowered until the
/// screen can show it.
Color color_from_lch(double lightness, double chroma, double hue_deg);

}  // namespace palpate::charts
