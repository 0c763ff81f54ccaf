#include <alsa/asoundlib.h>

#include "integration/sound/contact_sound.h"
#include "integration/sound/sound_device.h"

namespace palpate::sound {
namespace {

constexpr unsigned kLatency_us = 20'000;

struct ClosePcm {
  void operator()(snd_pcm_t* pcm) const { snd_pcm_close(pcm); }
};

/// ALSA would write what it finds onto the program's stderr.
void ignore(const char*, int, const char*, int, const char*, ...) {}

std::string words_of(int error) {
  return error < 0 ? snd_strerror(error) : "";
}

}  // namespace

struct SoundDevice::System {
  std::unique_ptr<snd_pcm_t, ClosePcm> pcm;
};

SoundDevice::SoundDevice() : system_(std::make_unique<System>()) {}
SoundDevice::~SoundDevice() = default;

std::string SoundDevice::open() {
  snd_lib_error_set_handler(ignore);
  snd_pcm_t* opened = nullptr;
  const int error = snd_pcm_open(&opened, "default", SND_PCM_STREAM_PLAYBACK, 0);
  if (error < 0) return words_of(error);
  system_->pcm.reset(opened);
  return words_of(snd_pcm_set_params(opened, SND_PCM_FORMAT_S16, SND_PCM_ACCESS_RW_INTERLEAVED, 1,
                                     kRate_hz, 1, kLatency_us));
}

std::string SoundDevice::play(const std::vector<int16_t>& samples) {
  snd_pcm_t* const pcm = system_->pcm.get();
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
  return words_of(error < 0 ? error : snd_pcm_drain(pcm));
}

}  // namespace palpate::sound
