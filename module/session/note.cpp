#include "module/session/note.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace palpate {
namespace {

/// The sentence of a kind; its fields are the note's numbers, then its words.
struct NoteSentence {
  NoteKind kind;
  const char* sentence;
  int share = -1;  ///< the number that is a share and said in percent; below 0: none
};

/// In the order of the kinds.
constexpr NoteSentence kNoteSentences[] = {
    {NoteKind::kText, "{0}"},
    {NoteKind::kSurfaceAt,
     "The surface to feel is put at {0:.4g}, between the two main groups of values: `iso_value` "
     "says otherwise."},
    {NoteKind::kClosedSurface,
     "A hand that strokes this surface comes to its end or to a hole within {0:.2g} mm at {1:.0f} "
     "% of its places.",
     1},
    {NoteKind::kOpenSurface,
     "This surface is no closed wall: at {1:.0f} % of its places it ends within {0:.2g} mm or has "
     "a hole there, and a hand that strokes it falls through; feel a segmentation instead "
     "(`segments`), or a wall derived from the values (`wall` region).",
     1},
    {NoteKind::kSurfaceReplaced,
     "The iso-surface is no closed wall: at {1:.0f} % of its places it ends within {0:.2g} mm or "
     "has a hole. (`wall` values feels it all the same.)",
     1},
    {NoteKind::kThinSurface,
     "At {0:.0f} % of its places this surface ends, or is too thin to hold a hand that presses "
     "with 1.5 N at the scale at which it is shown: there the hand passes through. Show it larger "
     "(`scale`), or feel a lower `iso_value`.",
     0},
    {NoteKind::kThinReplaced,
     "What is brighter than {0:.4g} is too thin to hold a hand at {1:.0f} % of its places at the "
     "scale at which it is shown, so the wall of what is around it is felt. (`wall` values feels "
     "it all the same.)",
     1},
    {NoteKind::kRegionWall,
     "The wall to feel is derived from the values: the border of what is brighter than {0:.4g}, "
     "in frame {1:.0f} smoothed by {2:.2g} mm. A hand that strokes it comes to an end at {3:.0f} "
     "% of its places.",
     3},
    {NoteKind::kNoData,
     "{0:.0f} % of the volume lies outside of what was scanned (one value in all frames): the "
     "border of the data is {1}.",
     0},
    {NoteKind::kRidgeWall,
     "The wall to feel is derived from the values: where the values rise most steeply, in frame "
     "{0:.0f} smoothed by {1:.2g} mm. A hand that strokes it comes to an end at {2:.0f} % of its "
     "places.",
     2},
    {NoteKind::kAlongVectors,
     "These are vectors: the hand is guided along them, with full force at a length of {0:.4g}; "
     "`iso_value` and `width` say otherwise, and a scene file offers other modes."},
    {NoteKind::kOwnBox, ""},  // own_box_text()
    {NoteKind::kStandsStill,
     "The {1} is that of frame {0:.0f}: {2} stands still there until one motion for all frames is "
     "known."},
    {NoteKind::kAssumedTimes,
     "The times of the frames of {2} are not known: all {0:.0f} are played in {1:.3g} s; {3} says "
     "otherwise."},
    {NoteKind::kOddCycle,
     "One cycle of {2} takes {0:.3g} s, {1:.3g} a minute: no heart and no breath. "
     "`frames_per_second` says otherwise; `cyclic` says that the last frame does not lead back to "
     "the first."},
    {NoteKind::kScaledDown,
     "It is shown at {0:.2g} of its size so that the device reaches all of it."},
};

static_assert(std::size(kNoteSentences) == size_t(NoteKind::kScaledDown) + 1);
static_assert([] {
  for (size_t k = 0; k < std::size(kNoteSentences); ++k)
    if (size_t(kNoteSentences[k].kind) != k) return false;
  return true;
}());

/// "3.5 x 2 x 1 m", of three numbers.
std::string edges_text(const double* edges_m) {
  return fmt::format("{:.4g} x {:.4g} x {:.4g} m", edges_m[0], edges_m[1], edges_m[2]);
}

std::string own_box_text(const Note& note) {
  const std::vector<double>& n = note.numbers;
  return fmt::format("The grid of {} lies obliquely and keeps its proportions: its box is {} ({}).",
                     note.words.at(0), edges_text(n.data()),
                     n.size() < 6 ? std::string("the scene gives no dimensions")
                                  : "the scene gives " + edges_text(&n[3]));
}

/// What was closed and opened of a wall of a region.
std::string closing_text(const Note& note) {
  const double closed_mm = note.numbers.at(4), opened_mm = note.numbers.at(5);
  if (!(opened_mm > 0.0)) return {};
  return fmt::format(
      " Notches below {:.2g} mm are filled, and what is thinner than {:.2g} mm is left out: it "
      "would not hold a hand.",
      2.0 * closed_mm, 2.0 * opened_mm);
}

}  // namespace

Note text_note(std::string sentence) {
  return {NoteKind::kText, {}, {std::move(sentence)}};
}

std::string note_text(const Note& note) {
  if (note.kind == NoteKind::kOwnBox) return own_box_text(note);
  const NoteSentence& of_kind = kNoteSentences[size_t(note.kind)];
  fmt::dynamic_format_arg_store<fmt::format_context> fields;
  for (int i = 0; i < int(note.numbers.size()); ++i)
    fields.push_back((i == of_kind.share ? 100.0 : 1.0) * note.numbers[size_t(i)]);
  for (const std::string& word : note.words) fields.push_back(word);
  std::string text = fmt::vformat(of_kind.sentence, fields);
  if (note.kind == NoteKind::kRegionWall) text += closing_text(note);
  return text;
}

}  // namespace palpate
