#include <windows.h>
// After windows.h, which it needs.
#include <mmsystem.h>

#include <array>

#include "integration/sound/contact_sound.h"
#include "integration/sound/sound_device.h"

namespace palpate::sound {
namespace {

std::string words_of(MMRESULT error) {
  std::array<wchar_t, MAXERRORLENGTH> text{};
  if (error == MMSYSERR_NOERROR) return "";
  if (waveOutGetErrorTextW(error, text.data(), UINT(text.size())) != MMSYSERR_NOERROR)
    return "unknown error";
  std::string words;
  for (const wchar_t* c = text.data(); *c; ++c) words += *c < 128 ? char(*c) : '?';
  return words;
}

}  // namespace

struct SoundDevice::System {
  HWAVEOUT out = nullptr;
  HANDLE heard = nullptr;  ///< an event: a block was played
};

SoundDevice::SoundDevice() : system_(std::make_unique<System>()) {}

SoundDevice::~SoundDevice() {
  if (system_->out) waveOutClose(system_->out);
  if (system_->heard) CloseHandle(system_->heard);
}

std::string SoundDevice::open() {
  system_->heard = CreateEventW(nullptr, FALSE, FALSE, nullptr);
  WAVEFORMATEX format{};
  format.wFormatTag = WAVE_FORMAT_PCM;
  format.nChannels = 1;
  format.wBitsPerSample = 16;
  format.nBlockAlign = sizeof(int16_t);
  format.nSamplesPerSec = kRate_hz;
  format.nAvgBytesPerSec = kRate_hz * format.nBlockAlign;
  return words_of(waveOutOpen(&system_->out, WAVE_MAPPER, &format, DWORD_PTR(system_->heard), 0,
                              CALLBACK_EVENT));
}

std::string SoundDevice::play(const std::vector<int16_t>& samples) {
  std::vector<int16_t> copy = samples;  // Windows asks for memory that may be changed
  WAVEHDR block{};
  block.lpData = reinterpret_cast<char*>(copy.data());
  block.dwBufferLength = DWORD(copy.size() * sizeof(int16_t));
  MMRESULT error = waveOutPrepareHeader(system_->out, &block, sizeof block);
  if (error != MMSYSERR_NOERROR) return words_of(error);
  error = waveOutWrite(system_->out, &block, sizeof block);
  // The event comes for other things, too.
  while (error == MMSYSERR_NOERROR && !(block.dwFlags & WHDR_DONE))
    WaitForSingleObject(system_->heard, 50);
  waveOutUnprepareHeader(system_->out, &block, sizeof block);
  return words_of(error);
}

}  // namespace palpate::sound
