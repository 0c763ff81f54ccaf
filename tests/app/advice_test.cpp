// What libraries say, with keys of options, and what the program makes of it.
#include "integration/app/advice.h"
#include "integration/app/session_flags.h"
#include "module/haptics/device.h"
#include "module/session/note.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Advice, SpellsTheKeysOfOptionsInNotes) {
  const std::pair<Note, const char*> all[] = {
      {{NoteKind::kSurfaceAt, {0.5}, {}},
       "The surface to feel is put at 0.5, between the two main groups of values: --iso-value "
       "says otherwise."},
      {{NoteKind::kOpenSurface, {5.0, 0.336}, {}},
       "This surface is no closed wall: at 34 % of its places it ends within 5 mm or has a hole "
       "there, and a hand that strokes it falls through; feel a segmentation instead (--segments), "
       "or a wall derived from the values (--wall region)."},
      {{NoteKind::kSurfaceReplaced, {5.0, 0.336}, {}},
       "The iso-surface is no closed wall: at 34 % of its places it ends within 5 mm or has a "
       "hole. (--wall values feels it all the same.)"},
      {{NoteKind::kThinSurface, {0.336}, {}},
       "At 34 % of its places this surface ends, or is too thin to hold a hand that presses with "
       "1.5 N at the scale at which it is shown: there the hand passes through. Show it larger "
       "(--scale), or feel a lower --iso-value."},
      {{NoteKind::kThinReplaced, {0.5, 0.336}, {}},
       "What is brighter than 0.5 is too thin to hold a hand at 34 % of its places at the scale at "
       "which it is shown, so the wall of what is around it is felt. (--wall values feels it all "
       "the same.)"},
      {{NoteKind::kAlongVectors, {12.0}, {}},
       "These are vectors: the hand is guided along them, with full force at a length of 12; "
       "--iso-value and --width say otherwise, and a scene file offers other modes."},
      {{NoteKind::kOddCycle, {20.0, 3.0}, {"heart"}},
       "One cycle of heart takes 20 s, 3 a minute: no heart and no breath. --fps says "
       "otherwise; --not-cyclic says that the last frame does not lead back to the first."},
      {{NoteKind::kAssumedTimes, {20.0, 1.0}, {"heart_cine", "`frames_per_second`"}},
       "The times of the frames of heart_cine are not known: all 20 are played in 1 s; --fps says "
       "otherwise."}};
  for (const auto& [note, text] : all) {
    EXPECT_THAT(note_text(note), Not(HasSubstr("--")));
    EXPECT_EQ(with_flags(note_text(note)), text);
  }
}

TEST(Advice, LeavesNotesAsTheyAreThatNoOptionChanges) {
  const std::pair<Note, const char*> all[] = {
      {text_note("A spacing is odd."), "A spacing is odd."},
      {{NoteKind::kClosedSurface, {5.0, 0.1}, {}},
       "A hand that strokes this surface comes to its end or to a hole within 5 mm at 10 % of its "
       "places."},
      {{NoteKind::kRegionWall, {100.0, 3.0, 2.0, 0.05, 0.0, 0.0}, {}},
       "The wall to feel is derived from the values: the border of what is brighter than 100, in "
       "frame 3 smoothed by 2 mm. A hand that strokes it comes to an end at 5 % of its places."},
      {{NoteKind::kRegionWall, {100.0, 3.0, 2.0, 0.05, 9.0, 6.0}, {}},
       "The wall to feel is derived from the values: the border of what is brighter than 100, in "
       "frame 3 smoothed by 2 mm. A hand that strokes it comes to an end at 5 % of its places. "
       "Notches below 18 mm are filled, and what is thinner than 12 mm is left out: it would not "
       "hold a hand."},
      {{NoteKind::kNoData, {0.42}, {"no wall"}},
       "42 % of the volume lies outside of what was scanned (one value in all frames): the border "
       "of the data is no wall."},
      {{NoteKind::kRidgeWall, {3.0, 2.0, 0.05}, {}},
       "The wall to feel is derived from the values: where the values rise most steeply, in frame "
       "3 smoothed by 2 mm. A hand that strokes it comes to an end at 5 % of its places."},
      {{NoteKind::kOwnBox, {0.1, 0.2, 0.3, 0.1, 0.2, 0.4}, {"heart"}},
       "The grid of heart lies obliquely and keeps its proportions: its box is 0.1 x 0.2 x 0.3 m "
       "(the scene gives 0.1 x 0.2 x 0.4 m)."},
      {{NoteKind::kOwnBox, {0.1, 0.2, 0.3}, {"heart"}},
       "The grid of heart lies obliquely and keeps its proportions: its box is 0.1 x 0.2 x 0.3 m "
       "(the scene gives no dimensions)."},
      {{NoteKind::kStandsStill, {7.0}, {"segmentation", "heart"}},
       "The segmentation is that of frame 7: heart stands still there until one motion for all "
       "frames is known."},
      {{NoteKind::kScaledDown, {0.5}, {}},
       "It is shown at 0.5 of its size so that the device reaches all of it."}};
  for (const auto& [note, text] : all) {
    EXPECT_EQ(note_text(note), text);
    EXPECT_EQ(with_flags(note_text(note)), text);
  }
}

TEST(Advice, SpellsKeysOfOptionsAndNothingElse) {
  EXPECT_EQ(with_flags(sentence(DeviceFault::kNoFirmware)),
            "The device needs its maker's firmware: give the file with --falcon-firmware.");
  EXPECT_EQ(with_flags("`heart` is `wall`, `real_time` or ` alone"),
            "`heart` is --wall, --no-real-time or ` alone");
}

TEST(Advice, SaysWhatWorksWithoutAWindow) {
  const Error advised = advised_window({ErrorKind::kNoDevice, "No window: start a desktop"});
  EXPECT_EQ(advised.kind, ErrorKind::kNoDevice);
  EXPECT_EQ(advised.message,
            "No window: start a desktop, or let it write pictures instead with --headless");
}

TEST(Advice, TellsWhatToDoAboutAHeadset) {
  using Kind = headset::HeadsetEvent::Kind;
  EXPECT_EQ(advised(headset::HeadsetEvent{Kind::kNote, "It is there."}), "It is there.");
  EXPECT_EQ(advised(headset::HeadsetEvent{Kind::kNoPassThrough, "It shows no room."}),
            "It shows no room: --pass-through does nothing.");
  for (const Kind kind : {Kind::kNoCalibration, Kind::kOtherSpace, Kind::kMisplaced})
    EXPECT_THAT(advised(headset::HeadsetEvent{kind, "It is elsewhere."}),
                ::testing::MatchesRegex("It is elsewhere: .*'palpate calibrate.*\\."));
}

}  // namespace
}  // namespace palpate::app
