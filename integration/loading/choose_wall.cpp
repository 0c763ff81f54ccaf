#include "integration/loading/choose_wall.h"

#include <algorithm>

#include "integration/files/sentences.h"

namespace palpate::loading {
namespace {

namespace fs = std::filesystem;

/// A surface of which a larger share of the places holds no hand is too thin. At the scale of a
/// usual device CT and teeth have less than 0.25 and a phantom whose wall just holds has 0.54, the
/// hot organs of PET 0.89 and 0.96.
constexpr double kTooThin = 0.75;

/// How well the iso-value that is asked for, or the best one, serves as a wall.
WallQuality values_as_wall(const Volume& frame, const SequenceChoices& choices) {
  return choices.iso_value
             ? wall_quality(frame, {*choices.iso_value, value_between_groups(frame).width})
             : wall_of(frame);
}

/// The share of a surface's places that hold no hand; 0 where any thickness holds.
double thin_share_of(const WallFrame& frame, double iso_value) {
  return frame.half_mm > 0.0 ? thin_share(frame.values, iso_value, frame.half_mm) : 0.0;
}

/// The iso-surface as a mode. thin: the share of its places that hold no hand. silent: without
/// notes.
Result<ChosenWall> surface_of(const WallFrame& frame, const WallQuality& found,
                              const SequenceChoices& choices, double thin, bool silent,
                              const fs::path& file) {
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
  if (frame.no_data > 0.0)
    chosen.notes.push_back({NoteKind::kNoData, {frame.no_data}, {"felt all the same"}});
  if (!choices.iso_value) chosen.notes.push_back({NoteKind::kSurfaceAt, {iso_value}, {}});
  chosen.notes.push_back(
      {found.ends > kClosedWall ? NoteKind::kOpenSurface : NoteKind::kClosedSurface,
       {found.aside_mm, found.ends},
       {}});
  if (thin > kTooThin) chosen.notes.push_back({NoteKind::kThinSurface, {thin}, {}});
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
  if (!choices.iso_value) chosen.notes.push_back({NoteKind::kAlongVectors, {longest}, {}});
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
  if (!of_vectors && glm::all(glm::greaterThan(frame.grid.size, glm::ivec3(1)))) finder_.add(frame);
}

void WallFrame::leave_out_no_data() {
  const auto found = finder_.found();
  if (!found || values.values.size() != found->values.size()) return;
  no_data = share_of(*found);
  continue_into(values, *found);
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

  // An iso-surface that is no closed wall, or has the border of the data in it, is replaced, if
  // nothing was asked for and a motion can carry what replaces it.
  const WallQuality found = values_as_wall(frame.values, choices);
  const bool is_open = found.ends > kClosedWall;
  if (choices.wall == FeltWall::kUsual && (is_open || frame.no_data > 0.0) && !choices.iso_value &&
      !choices.width && can_carry) {
    auto derived = derive_wall(frame, derived_by(choices, FeltWall::kRegion), file);
    if (derived) {
      if (is_open)
        derived->notes.insert(derived->notes.begin(),
                              {NoteKind::kSurfaceReplaced, {found.aside_mm, found.ends}, {}});
      return derived;
    }
  }
  const bool silent = choices.wall == FeltWall::kNotFelt;
  const double thin = is_open || silent ? 0.0 : thin_share_of(frame, found.at.iso_value);

  // So is one that is too thin to hold a hand, where what is around it is thick enough.
  if (choices.wall == FeltWall::kUsual && thin > kTooThin && !choices.iso_value && !choices.width &&
      can_carry) {
    SegmentsSpec around = derived_by(choices, FeltWall::kRegion);
    around.iso_value = value_between_groups(frame.values, found.at.iso_value).iso_value;
    auto derived = derive_wall(frame, around, file);
    if (derived && derived->derived->ends <= kClosedWall) {
      derived->notes.insert(derived->notes.begin(),
                            {NoteKind::kThinReplaced, {found.at.iso_value, thin}, {}});
      return derived;
    }
  }
  return surface_of(frame, found, choices, thin, silent, file);
}

Result<ChosenWall> derive_wall(const WallFrame& frame, const SegmentsSpec& segments,
                               const fs::path& file) {
  const bool ridges = segments.from == SegmentsFrom::kRidges;
  ChosenWall chosen;
  chosen.segments = segments;
  const auto derive = ridges ? &ridge_wall : &region_wall;
  chosen.derived = derive(frame.values, frame.half_mm, segments.iso_value, segments.smooth_mm);
  if (!chosen.derived)
    return files::bad_input(
        file,
        "has nothing large enough that is brighter than {:.4g} and has a border: choose another "
        "iso-value, or the wall 'values'",
        segments.iso_value.value_or(wall_of(frame.values).at.iso_value));
  if (frame.no_data > 0.0)
    chosen.notes.push_back({NoteKind::kNoData, {frame.no_data}, {"no wall"}});
  const DerivedWall& wall = *chosen.derived;
  const auto number = double(frame.number);
  chosen.notes.push_back(ridges
                             ? Note{NoteKind::kRidgeWall, {number, wall.smooth_mm, wall.ends}, {}}
                             : Note{NoteKind::kRegionWall,
                                    {wall.iso_value, number, wall.smooth_mm, wall.ends,
                                     wall.closed_mm, wall.opened_mm},
                                    {}});
  return chosen;
}

}  // namespace palpate::loading
