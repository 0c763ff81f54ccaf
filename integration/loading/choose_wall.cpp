#include "integration/loading/choose_wall.h"

#include <fmt/format.h>

#include <algorithm>

#include "integration/files/sentences.h"

namespace palpate::loading {
namespace {

namespace fs = std::filesystem;

/// How well the iso-value that is asked for, or the best one, serves as a wall.
WallQuality values_as_wall(const Volume& frame, const SequenceChoices& choices) {
  return choices.iso_value
             ? wall_quality(frame, {*choices.iso_value, value_between_groups(frame).width})
             : wall_of(frame);
}

/// The iso-surface as a mode. silent: without notes.
Result<ChosenWall> surface_of(const WallFrame& frame, const WallQuality& found,
                              const SequenceChoices& choices, bool silent, const fs::path& file) {
  const double iso_value = found.at.iso_value;
  if (!(iso_value >= frame.low && iso_value <= frame.high))
    return files::bad_input(
        file, "has values from {:.6g} to {:.6g}: there is no surface at the iso-value {:.6g}",
        frame.low, frame.high, iso_value);
  auto strength = TransferFunction::window(iso_value, choices.width.value_or(found.at.width),
                                           choices.strength_n);
  if (!strength) return strength.error();
  ChosenWall chosen;
  ModeSpec& surface = chosen.mode.emplace();
  surface.name = "surface";
  surface.strength = *strength;
  surface.friction = TransferFunction::constant(choices.friction);
  if (silent) return chosen;
  if (!choices.iso_value)
    chosen.notes.push_back(
        fmt::format("The surface to feel is put at {:.4g}, between the two main groups of values: "
                    "an iso-value says otherwise.",
                    iso_value));
  if (found.ends > kClosedWall)
    chosen.notes.push_back(fmt::format(
        "This surface is no closed wall: at {:.0f} % of its places it ends within {:.2g} mm "
        "or has a hole there, and a hand that strokes it falls through; feel a segmentation "
        "instead, or a wall derived from the values (the wall 'region').",
        100.0 * found.ends, found.aside_mm));
  else
    chosen.notes.push_back(
        fmt::format("A hand that strokes this surface comes to its end or to a hole within {:.2g} "
                    "mm at {:.0f} % of its places.",
                    found.aside_mm, 100.0 * found.ends));
  return chosen;
}

/// Vectors guide the hand along them. The strength rises with their length and is full at the
/// longest.
Result<ChosenWall> guide_along(const Volume& lengths, const SequenceChoices& choices) {
  const double longest = lengths.values.empty()
                             ? 0.0
                             : *std::max_element(lengths.values.begin(), lengths.values.end());
  const double iso_value = choices.iso_value.value_or(0.5 * longest);
  const double width = choices.width.value_or(choices.iso_value ? 0.0 : longest);
  auto strength = TransferFunction::window(iso_value, width, choices.strength_n);
  if (!strength) return strength.error();
  ChosenWall chosen;
  if (!choices.iso_value)
    chosen.notes.push_back(fmt::format(
        "These are vectors: the hand is guided along them, with full force at a length of {:.4g}; "
        "an iso-value and a width say otherwise, and a scene file offers other modes.",
        longest));
  ModeSpec& follow = chosen.mode.emplace();
  follow.name = "along";
  follow.kind = "follow";
  follow.strength = *strength;
  return chosen;
}

/// What the choices say of a derived wall.
SegmentsSpec derived_by(const SequenceChoices& choices, FeltWall wall) {
  SegmentsSpec derived;
  derived.from = wall == FeltWall::kRidges ? SegmentsFrom::kRidges : SegmentsFrom::kRegion;
  derived.iso_value = choices.iso_value;
  SegmentSpec& part = derived.parts.emplace_back();
  part.name = "wall";
  part.strength_n = choices.strength_n;
  part.friction = choices.friction;
  return derived;
}

}  // namespace

void WallFrame::add(size_t k, const Volume& frame) {
  if (frame.values.empty()) return;
  const auto [least, most] = std::minmax_element(frame.values.begin(), frame.values.end());
  low = std::min(low, *least);
  high = std::max(high, *most);
  if (k == number) values = frame;
}

Result<ChosenWall> choose_wall(const WallFrame& frame, const SequenceChoices& choices,
                               bool can_carry, const fs::path& file) {
  const bool asks_for_derived =
      choices.wall == FeltWall::kRegion || choices.wall == FeltWall::kRidges;

  // Vectors have no surface.
  if (frame.of_vectors) {
    if (asks_for_derived)
      return files::bad_input(
          file, "holds vectors, and walls are derived from scalars: leave the wall out");
    return guide_along(frame.values, choices);
  }

  // A wall that is asked for can fail; nothing takes its place.
  if (asks_for_derived) return derive_wall(frame, derived_by(choices, choices.wall), file);

  // An iso-surface that is no closed wall is replaced, if nothing was asked for and a motion can
  // carry what replaces it.
  const WallQuality found = values_as_wall(frame.values, choices);
  if (choices.wall == FeltWall::kUsual && found.ends > kClosedWall && !choices.iso_value &&
      !choices.width && can_carry) {
    auto derived = derive_wall(frame, derived_by(choices, FeltWall::kRegion), file);
    if (derived) {
      derived->notes.insert(
          derived->notes.begin(),
          fmt::format("The iso-surface is no closed wall: at {:.0f} % of its places it ends within "
                      "{:.2g} mm or has a hole. (The wall 'values' is this surface all the same.)",
                      100.0 * found.ends, found.aside_mm));
      return derived;
    }
  }
  return surface_of(frame, found, choices, choices.wall == FeltWall::kNotFelt, file);
}

Result<ChosenWall> derive_wall(const WallFrame& frame, const SegmentsSpec& segments,
                               const fs::path& file) {
  const bool ridges = segments.from == SegmentsFrom::kRidges;
  ChosenWall chosen;
  chosen.segments = segments;
  chosen.derived = ridges ? ridge_wall(frame.values, segments.iso_value, segments.smooth_mm)
                          : region_wall(frame.values, segments.iso_value, segments.smooth_mm);
  if (!chosen.derived)
    return files::bad_input(
        file,
        "has nothing large enough that is brighter than {:.4g} and has a border: choose another "
        "iso-value, or the wall 'values'",
        segments.iso_value.value_or(wall_of(frame.values).at.iso_value));
  const DerivedWall& wall = *chosen.derived;
  chosen.notes.push_back(fmt::format(
      "The wall to feel is derived from the values: {}, in frame {} smoothed by {:.2g} mm. A hand "
      "that strokes it "
      "comes to an end at {:.0f} % of its places.",
      ridges ? "where the values rise most steeply"
             : fmt::format("the border of what is brighter than {:.4g}", wall.iso_value),
      frame.number, wall.smooth_mm, 100.0 * wall.ends));
  return chosen;
}

}  // namespace palpate::loading
