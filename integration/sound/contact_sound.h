#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace palpate::sound {

inline constexpr int kRate_hz = 48000;

/// What is heard at a contact: 40 ms of 660 Hz that come in 1 ms and die away, one channel,
/// 16 bits, kRate_hz; a quarter of the loudest at most, and zero at both ends, so that it does not
/// click.
std::vector<int16_t> contact_tone();

/// Plays contact_tone() on the system's sound device, from a thread of its own: who asks for it
/// never waits. Silent where there is no sound device.
class ContactSound {
 public:
  /// Opens the device in the background.
  ContactSound();
  /// Waits for a tone that is being played.
  ~ContactSound();
  ContactSound(const ContactSound&) = delete;
  ContactSound& operator=(const ContactSound&) = delete;

  /// Soon; one that was asked for while another plays is left out. Any thread.
  void play();
  /// Why it is silent, a sentence, the first time that it is asked for; then empty. Any thread.
  std::string take_trouble();

 private:
  void run(std::stop_token stop);

  std::mutex mutex_;  ///< of what follows but the thread
  std::condition_variable_any changed_;
  bool wanted_ = false;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace palpate::sound
