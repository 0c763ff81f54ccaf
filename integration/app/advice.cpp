#include "integration/app/advice.h"

#include <cassert>
#include <utility>

namespace palpate::app {
namespace {

/// The sentence with words of the program in the place of neutral ones.
std::string replaced(std::string sentence, const std::string& neutral, const std::string& ours) {
  const size_t at = sentence.find(neutral);
  assert(at != std::string::npos && "the library says it in other words");
  return at == std::string::npos ? sentence : sentence.replace(at, neutral.size(), ours);
}

/// The sentence with more words before its full stop.
std::string longer(const std::string& sentence, const std::string& more) {
  return sentence.substr(0, sentence.size() - 1) + more + ".";
}

}  // namespace

std::string advised(const Note& note, const char* times_by) {
  const std::string text = note_text(note);
  switch (note.kind) {
    case NoteKind::kSurfaceAt:
      return replaced(text, "an iso-value says", "--iso-value says");
    case NoteKind::kOpenSurface:
      return replaced(text, "instead, or a wall derived from the values (the wall 'region')",
                      "instead (--segments), or a wall derived from the values (--wall region)");
    case NoteKind::kSurfaceReplaced:
      return replaced(text, "The wall 'values' is this surface", "--wall values feels it");
    case NoteKind::kAlongVectors:
      return replaced(text, "an iso-value and a width say", "--iso-value and --width say");
    case NoteKind::kAssumedTimes:
      return replaced(text, "frames_per_second", times_by);
    case NoteKind::kDeviceOfScene:
      return replaced(text, "the program chooses the device that gives the force",
                      "which device gives the force is said by --device");
    default:
      return text;
  }
}

std::string advised(const headset::HeadsetEvent& event) {
  using Kind = headset::HeadsetEvent::Kind;
  switch (event.kind) {
    case Kind::kNote:
      break;
    case Kind::kNoPassThrough:
      return longer(event.sentence, ": --pass-through does nothing");
    case Kind::kNoCalibration:
      return longer(
          event.sentence,
          ": find it with 'palpate calibrate -o room.json', and add --calibration room.json");
    case Kind::kOtherSpace:
      return longer(event.sentence, ": calibrate again with 'palpate calibrate'");
    case Kind::kMisplaced:
      return longer(event.sentence, ": touch again, or calibrate anew with 'palpate calibrate'");
  }
  return event.sentence;
}

std::string advised(DeviceFault fault) {
  const std::string text = sentence(fault);
  return fault == DeviceFault::kNoFirmware
             ? replaced(text, "give its file", "give the file with --falcon-firmware")
             : text;
}

std::string advised(const devices::ListedDevice& device) {
  return device.lacks_firmware ? longer(device.wrong, " and give it with --falcon-firmware FILE")
                               : device.wrong;
}

Error advised_window(Error error) {
  error.message += ", or let it write pictures instead with --headless";
  return error;
}

}  // namespace palpate::app
