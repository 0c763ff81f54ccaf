#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

/// What a note says, with its numbers and words in this order.
enum class NoteKind : uint8_t {
  kText,             ///< words: a whole sentence, on files or other things that nothing can change
  kSurfaceAt,        ///< numbers: the iso-value that was found between the main groups of values
  kClosedSurface,    ///< numbers: mm, and the share of places with an end or a hole within them
  kOpenSurface,      ///< the same, of a surface that is no closed wall
  kSurfaceReplaced,  ///< the same, where a derived wall is felt instead
  kThinSurface,      ///< numbers: the share of its places that hold no hand
  kThinReplaced,     ///< numbers: iso-value, and this share, where a lower value is felt instead
  /// numbers: iso-value, frame, smoothing in mm, share of places with an end, mm by which it was
  /// closed and opened
  kRegionWall,
  kNoData,        ///< words: "no wall" or "felt all the same"; numbers: the share of the volume
  kRidgeWall,     ///< numbers: frame, smoothing in mm, share of places with an end
  kAlongVectors,  ///< numbers: the length with full force
  kOwnBox,        ///< words: volume; numbers: its box, m, and the scene's (none: it gives none)
  kStandsStill,   ///< words: "segmentation" or "wall", volume; numbers: frame
  kAssumedTimes,  ///< words: volume, what says the times; numbers: frames, s of all
  kOddCycle,      ///< words: volume; numbers: s of a cycle, cycles a minute
  kScaledDown,    ///< numbers: the share of its size
};

/// Something that a person should know of a scene: a choice that was made, or what is unusual of
/// its data. A value, so that each program can say it in its own words.
struct Note {
  NoteKind kind = NoteKind::kText;
  std::vector<double> numbers;
  std::vector<std::string> words;
};

/// A note of words alone.
Note text_note(std::string sentence);

/// The note in one or two sentences. Options of a session are named by their keys, as `iso_value`
/// (integration/running/session_options.h), which the command line spells in its own way.
std::string note_text(const Note& note);

}  // namespace palpate
