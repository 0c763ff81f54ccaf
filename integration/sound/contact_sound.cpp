#include "integration/sound/contact_sound.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "integration/sound/sound_device.h"

namespace palpate::sound {
namespace {

constexpr double kLength_s = 0.040, kRise_s = 0.001, kDecay_s = 0.010, kTone_hz = 660.0;
constexpr double kLoudest = 0.25 * 32767.0;

}  // namespace

std::vector<int16_t> contact_tone() {
  std::vector<int16_t> samples(size_t(kLength_s * kRate_hz));
  for (size_t k = 0; k < samples.size(); ++k) {
    const double t = double(k) / kRate_hz, left_s = kLength_s - t;
    // Rises, and fades at its end, as half a cosine each.
    const auto edge = [](double s) {
      return s >= kRise_s ? 1.0 : 0.5 - 0.5 * std::cos(std::numbers::pi * s / kRise_s);
    };
    const double loud =
        kLoudest * edge(t) * edge(left_s - 1.0 / kRate_hz) * std::exp(-t / kDecay_s);
    samples[k] = int16_t(std::lround(loud * std::sin(2.0 * std::numbers::pi * kTone_hz * t)));
  }
  return samples;
}

ContactSound::ContactSound() : thread_([this](std::stop_token stop) { run(stop); }) {}

ContactSound::~ContactSound() = default;

void ContactSound::play() {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = true;
  }
  changed_.notify_one();
}

std::string ContactSound::take_trouble() {
  const std::lock_guard lock(mutex_);
  return std::exchange(trouble_, {});
}

void ContactSound::run(std::stop_token stop) {
  const std::vector<int16_t> samples = contact_tone();
  SoundDevice device;
  std::string problem = device.open();
  while (problem.empty()) {
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return wanted_; })) return;
    }
    problem = device.play(samples);
    const std::lock_guard lock(mutex_);
    wanted_ = false;
  }
  const std::lock_guard lock(mutex_);
  trouble_ = "There is no sound where something is touched: the sound device can not be used (" +
             problem + ").";
}

}  // namespace palpate::sound
