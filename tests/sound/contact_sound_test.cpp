// The tone, and its way to ALSA: ALSA's own file device replaces the loudspeaker.
#include "integration/sound/contact_sound.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>

#include "tests/files/temporary_folder.h"
#include "tests/support/wait_for.h"

namespace palpate::sound {
namespace {

TEST(ContactTone, IsShortQuietAndDoesNotClick) {
  const std::vector<int16_t> tone = contact_tone();
  ASSERT_EQ(tone.size(), size_t(0.040 * kRate_hz));
  EXPECT_EQ(tone.front(), 0);
  EXPECT_EQ(tone.back(), 0);
  int loudest = 0, steepest = 0;
  for (size_t k = 1; k < tone.size(); ++k) {
    loudest = std::max(loudest, std::abs(int(tone[k])));
    steepest = std::max(steepest, std::abs(int(tone[k]) - int(tone[k - 1])));
  }
  EXPECT_GT(loudest, 32767 / 8);
  EXPECT_LE(loudest, 32767 / 4);
  // No steeper than its own sine, as an edge would be.
  EXPECT_LE(steepest, 2.0 * std::numbers::pi * 660.0 / kRate_hz * 32767 / 4 + 1.0);
}

TEST(ContactTone, IsAt660Hz) {
  const std::vector<int16_t> tone = contact_tone();
  const auto power = [&](double hz) {
    double re = 0.0, im = 0.0;
    for (size_t k = 0; k < tone.size(); ++k) {
      const double angle = 2.0 * std::numbers::pi * hz * double(k) / kRate_hz;
      re += tone[k] * std::cos(angle);
      im += tone[k] * std::sin(angle);
    }
    return re * re + im * im;
  };
  for (const double other : {330.0, 500.0, 880.0, 1320.0})
    EXPECT_GT(power(660.0), 4.0 * power(other)) << other;
}

/// Replaces ALSA's configuration for devices that are opened during the object's life.
class AlsaWith {
 public:
  explicit AlsaWith(const std::string& config) {
    const std::string file = folder / "asound.conf";
    std::ofstream(file) << config;
    setenv("ALSA_CONFIG_PATH", file.c_str(), 1);
  }
  ~AlsaWith() { unsetenv("ALSA_CONFIG_PATH"); }
  files::TemporaryFolder folder;
};

std::vector<int16_t> samples_in(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  std::vector<int16_t> samples(bytes.size() / 2);
  std::memcpy(samples.data(), bytes.data(), 2 * samples.size());
  return samples;
}

TEST(ContactSound, PlaysTheToneEachTimeItIsAskedTo) {
  files::TemporaryFolder out;
  const std::string file = out / "played.raw";
  const AlsaWith alsa("pcm.!default { type file slave.pcm { type null } file \"" + file +
                      "\" format raw }\n");
  const std::vector<int16_t> tone = contact_tone();
  ContactSound sound;
  for (int times = 1; times <= 3; ++times) {
    const size_t before = samples_in(file).size();
    // Asked for again and again: one that is asked for while another plays is left out.
    ASSERT_TRUE(wait_for([&] {
      sound.play();
      const std::vector<int16_t> played = samples_in(file);
      return std::search(played.begin() + ptrdiff_t(std::min(before, played.size())), played.end(),
                         tone.begin() + 1, tone.end() - 1) != played.end();
    })) << times
        << sound.take_trouble();
  }
  EXPECT_EQ(sound.take_trouble(), "");
}

TEST(ContactSound, IsSilentWithoutASoundDeviceAndSaysSoOnce) {
  const AlsaWith alsa("");
  ContactSound sound;
  sound.play();
  std::string said;
  ASSERT_TRUE(wait_for([&] {
    said = sound.take_trouble();
    return !said.empty();
  }));
  EXPECT_EQ(said.rfind("There is no sound where something is touched", 0), 0u) << said;
  sound.play();
  EXPECT_EQ(sound.take_trouble(), "");
}

TEST(ContactSound, EndsWhileNobodyAsksForIt) {
  const AlsaWith alsa("pcm.!default { type null }\n");
  const auto threads = [] {
    const std::filesystem::directory_iterator tasks("/proc/self/task");
    return std::distance(begin(tasks), end(tasks));
  };
  const auto before = threads();
  for (int k = 0; k < 20; ++k) {
    const ContactSound sound;
    EXPECT_GT(threads(), before);
  }
  EXPECT_EQ(threads(), before);
}

}  // namespace
}  // namespace palpate::sound
