#pragma once

#include <string>

namespace palpate::headset {

/// What has happened in the headset: a kind for programs, which may know what to do about it, and a
/// sentence for people.
struct HeadsetEvent {
  enum class Kind {
    kNote,           ///< something that a person may want to know
    kNoPassThrough,  ///< this headset does not show the room
    kNoCalibration,  ///< where the force device stands in the room is not known
    kOtherSpace,     ///< the calibration is about a space that the runtime does not have
    kMisplaced,      ///< a touched point shows that the calibration is not right any more
  } kind = Kind::kNote;
  std::string sentence;
};

}  // namespace palpate::headset
