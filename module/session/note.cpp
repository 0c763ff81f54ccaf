#include "module/session/note.h"

#include <fmt/format.h>

#include <utility>

namespace palpate {
namespace {

/// "3.5 x 2 x 1 m", of three numbers.
std::string edges_text(const double* edges_m) {
  return fmt::format("{:.4g} x {:.4g} x {:.4g} m", edges_m[0], edges_m[1], edges_m[2]);
}

std::string derived_text(const std::string& where, const double* frame_smooth_ends) {
  return fmt::format(
      "The wall to feel is derived from the values: {}, in frame {:.0f} smoothed by {:.2g} mm. A "
      "hand that strokes it comes to an end at {:.0f} % of its places.",
      where, frame_smooth_ends[0], frame_smooth_ends[1], 100.0 * frame_smooth_ends[2]);
}

}  // namespace

Note text_note(std::string sentence) {
  return {NoteKind::kText, {}, {std::move(sentence)}};
}

std::string note_text(const Note& note) {
  const std::vector<double>& n = note.numbers;
  const std::vector<std::string>& words = note.words;
  switch (note.kind) {
    case NoteKind::kText:
      return words.at(0);
    case NoteKind::kSurfaceAt:
      return fmt::format(
          "The surface to feel is put at {:.4g}, between the two main groups of values: "
          "`iso_value` says otherwise.",
          n.at(0));
    case NoteKind::kClosedSurface:
      return fmt::format(
          "A hand that strokes this surface comes to its end or to a hole within {:.2g} mm at "
          "{:.0f} % of its places.",
          n.at(0), 100.0 * n.at(1));
    case NoteKind::kOpenSurface:
      return fmt::format(
          "This surface is no closed wall: at {:.0f} % of its places it ends within {:.2g} mm or "
          "has a hole there, and a hand that strokes it falls through; feel a segmentation "
          "instead (`segments`), or a wall derived from the values (`wall` region).",
          100.0 * n.at(1), n.at(0));
    case NoteKind::kSurfaceReplaced:
      return fmt::format(
          "The iso-surface is no closed wall: at {:.0f} % of its places it ends within {:.2g} mm "
          "or has a hole. (`wall` values feels it all the same.)",
          100.0 * n.at(1), n.at(0));
    case NoteKind::kThinSurface:
      return fmt::format(
          "At {:.0f} % of its places this surface ends, or is too thin to hold a hand that presses "
          "with 1.5 N at the scale at which it is shown: there the hand passes through. Show it "
          "larger "
          "(`scale`), or feel a lower `iso_value`.",
          100.0 * n.at(0));
    case NoteKind::kThinReplaced:
      return fmt::format(
          "What is brighter than {:.4g} is too thin to hold a hand at {:.0f} % of its places at "
          "the scale at which it is shown, so the wall of what is around it is felt. (`wall` "
          "values "
          "feels it all the same.)",
          n.at(0), 100.0 * n.at(1));
    case NoteKind::kRegionWall:
      return derived_text(fmt::format("the border of what is brighter than {:.4g}", n.at(0)),
                          &n[1]) +
             (n.at(5) > 0.0
                  ? fmt::format(" Notches below {:.2g} mm are filled, and what is thinner than "
                                "{:.2g} mm is left out: it would not hold a hand.",
                                2.0 * n.at(4), 2.0 * n.at(5))
                  : "");
    case NoteKind::kNoData:
      return fmt::format(
          "{:.0f} % of the volume lies outside of what was scanned (one value in all frames): the "
          "border of the data is {}.",
          100.0 * n.at(0), words.at(0));
    case NoteKind::kRidgeWall:
      return derived_text("where the values rise most steeply", n.data());
    case NoteKind::kAlongVectors:
      return fmt::format(
          "These are vectors: the hand is guided along them, with full force at a length of "
          "{:.4g}; `iso_value` and `width` say otherwise, and a scene file offers other modes.",
          n.at(0));
    case NoteKind::kOwnBox:
      return fmt::format(
          "The grid of {} lies obliquely and keeps its proportions: its box is {} ({}).",
          words.at(0), edges_text(n.data()),
          n.size() < 6 ? std::string("the scene gives no dimensions")
                       : "the scene gives " + edges_text(&n[3]));
    case NoteKind::kStandsStill:
      return fmt::format(
          "The {} is that of frame {:.0f}: {} stands still there until one motion for all frames "
          "is known.",
          words.at(0), n.at(0), words.at(1));
    case NoteKind::kAssumedTimes:
      return fmt::format(
          "The times of the frames of {} are not known: all {:.0f} are played in {:.3g} s; "
          "{} says otherwise.",
          words.at(0), n.at(0), n.at(1), words.at(1));
    case NoteKind::kOddCycle:
      return fmt::format(
          "One cycle of {} takes {:.3g} s, {:.3g} a minute: no heart and no breath. "
          "`frames_per_second` says otherwise; `cyclic` says that the last frame does not lead "
          "back to the first.",
          words.at(0), n.at(0), n.at(1));
    case NoteKind::kScaledDown:
      return fmt::format("It is shown at {:.2g} of its size so that the device reaches all of it.",
                         n.at(0));
  }
  return {};
}

}  // namespace palpate
