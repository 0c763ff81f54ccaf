#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/volume.h"
#include "module/scene/frame_data.h"

namespace palpate {

/// What one value of the data looks like.
struct LookPoint {
  double value = 0.0;      ///< of the data, in its unit (HU for CT)
  glm::dvec3 colour{1.0};  ///< sRGB, 0 to 1, as a person names colours
  double opacity = 0.0;    ///< share of the light that the look's thickness_mm absorbs, 0 to 0.999
  bool operator==(const LookPoint&) const = default;
};

/// Lighting of surfaces, as shares; what is not a surface emits its colour.
struct Shine {
  double ambient = 0.35;
  double diffuse = 0.75;
  double specular = 0.18;
  bool operator==(const Shine&) const = default;
};

/// What a volume looks like: colour and opacity of every value, linear between points and clamped
/// beyond them, and how surfaces shine.
struct Look {
  std::string name;
  std::vector<LookPoint> points;  ///< values rising; empty: nothing is seen
  Shine shine;
  /// Slope at which a place counts as a surface and is fully shaded, in the data's unit per mm. 0:
  /// a tenth of the points' range per mm.
  double surface_slope = 0.0;
  double thickness_mm = 1.0;  ///< the thickness for which the points' opacities hold
  /// Share of the extinction that is left where the values are flat; it rises to 1 at surfaces (see
  /// surface_slope), with the square of the slope. 1: the opacity depends on the value alone.
  double flat_opacity = 1.0;
  bool operator==(const Look&) const = default;
};

/// Colour and extinction of a value, as light is added up.
struct LookSample {
  glm::dvec3 colour{0.0};  ///< linear, not multiplied by anything
  double extinction_per_mm = 0.0;
};

/// Empty if the look can be drawn, else what to change, in a sentence: values rising and finite,
/// colours, opacities and the thickness within their ranges.
Status check(const Look& look);

/// What `value` looks like. Opacity a of thickness d is the extinction -ln(1 - a) / d (Beer and
/// Lambert); colours are blended as written, in sRGB, and then made linear. NaN is transparent.
LookSample look_at(const Look& look, double value);

/// The same look for another window: its first value moves to level - width / 2, its last one to
/// level + width / 2. Needs width > 0.
Look windowed(Look look, double level, double width);
/// Converts a look whose values are shares, 0 to 1, of the way from `lowest` to `highest`, and
/// whose opacities are those of `thickness_mm` instead of 1 mm, as in the transfer functions that
/// other renderers keep in textures. The slope of a surface is per thickness too, so that the look
/// does not change with the unit of lengths. Needs highest >= lowest, thickness > 0.
Look over_range(Look look, double lowest, double highest, double thickness_mm);
/// The level and width of a look as it is.
double level_of(const Look& look);
double width_of(const Look& look);

/// "CT bone", "CT heart", "CT lung", "MR", "phantom" (the beating shell), "molecule", "flow" and
/// "heart" (the heart phantom); kBadInput for another name.
Result<Look> preset_look(std::string_view name);
/// In the order in which they are offered.
std::vector<std::string> preset_names();

/// What decides on a look, of one frame.
struct ValueSummary {
  double lowest = 0.0, highest = 0.0;
  /// Between the background (air, gel, what was not scanned) and what is to be seen: Otsu's
  /// threshold; the lowest value where there is no background.
  double background = 0.0;
  /// Of the values above it: those below which a quarter, 6 of 10, 9 of 10 and 99 of 100 lie.
  std::array<double, 4> foreground{};
  double surface_slope = 0.0;  ///< a tenth of the places above it are steeper, per mm
  double size_mm = 1.0;        ///< the diagonal of the data
};

/// Reads about 60,000 places spread over the frame; those that no_data counts are left out. Not
/// real-time safe.
ValueSummary summary_of(const FrameData& frame, const Mask* no_data = nullptr);

/// The look that suits such data: CT in HU reaches below -300 ("CT bone", or "CT lung" where there
/// is no bone). Of all else, whatever its unit is, borders are seen more than what is between
/// them, from the background up to what is bright.
Look fitting_look(const ValueSummary& values);

/// sRGB to linear light, 0 to 1.
double linear_from_srgb(double encoded);

}  // namespace palpate
