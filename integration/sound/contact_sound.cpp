#include "integration/sound/contact_sound.h"

#include <alsa/asoundlib.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace palpate::sound {
namespace {

constexpr double kLength_s = 0.040, kRise_s = 0.001, kDecay_s = 0.010, kTone_hz = 660.0;
constexpr double kLoudest = 0.25 * 32767.0;
constexpr unsigned kLatency_us = 20'000;

struct ClosePcm {
  void operator()(snd_pcm_t* pcm) const { snd_pcm_close(pcm); }
};
using Pcm = std::unique_ptr<snd_pcm_t, ClosePcm>;

/// ALSA would write what it finds onto the program's stderr.
void ignore(const char*, int, const char*, int, const char*, ...) {}

int open(Pcm& pcm) {
  snd_lib_error_set_handler(ignore);
  snd_pcm_t* opened = nullptr;
  int error = snd_pcm_open(&opened, "default", SND_PCM_STREAM_PLAYBACK, 0);
  if (error < 0) return error;
  pcm.reset(opened);
  error = snd_pcm_set_params(opened, SND_PCM_FORMAT_S16, SND_PCM_ACCESS_RW_INTERLEAVED, 1, kRate_hz,
                             1, kLatency_us);
  if (error < 0) pcm.reset();
  return error;
}

/// 0, or what ALSA says once it can not be helped.
int play(snd_pcm_t* pcm, const std::vector<int16_t>& samples) {
  int error = snd_pcm_prepare(pcm);
  size_t done = 0;
  while (error >= 0 && done < samples.size()) {
    const snd_pcm_sframes_t written =
        snd_pcm_writei(pcm, samples.data() + done, samples.size() - done);
    if (written >= 0)
      done += size_t(written);
    else
      error = snd_pcm_recover(pcm, int(written), 1);
  }
  return error < 0 ? error : snd_pcm_drain(pcm);
}

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
  Pcm pcm;
  int error = open(pcm);
  while (error >= 0) {
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return wanted_; })) return;
    }
    error = sound::play(pcm.get(), samples);
    const std::lock_guard lock(mutex_);
    wanted_ = false;
  }
  const std::lock_guard lock(mutex_);
  trouble_ = std::string(
                 "There is no sound where something is touched: the sound device can not be "
                 "used (") +
             snd_strerror(error) + ").";
}

}  // namespace palpate::sound
