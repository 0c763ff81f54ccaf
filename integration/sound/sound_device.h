#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace palpate::sound {

/// The system's own sound device: ALSA's "default", which PipeWire and PulseAudio stand behind too,
/// or what Windows plays on. One thread.
class SoundDevice {
 public:
  SoundDevice();
  ~SoundDevice();

  /// Before play(). Empty, or why it can not be used, in the system's words.
  std::string open();
  /// One channel at kRate_hz; returns when it was heard. As open().
  std::string play(const std::vector<int16_t>& samples);

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace palpate::sound
