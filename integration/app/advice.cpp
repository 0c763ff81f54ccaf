#include "integration/app/advice.h"

#include <utility>

namespace palpate::app {
namespace {

/// The sentence with more words before its full stop.
std::string longer(const std::string& sentence, const std::string& more) {
  return sentence.substr(0, sentence.size() - 1) + more + ".";
}

}  // namespace

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

Error advised_window(Error error) {
  error.message += ", or let it write pictures instead with --headless";
  return error;
}

}  // namespace palpate::app
