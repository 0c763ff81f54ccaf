// Recordings: what was written is read again bit by bit, a replay gives the same bits, and an
// incomplete or damaged recording is refused with a message.
#include "module/haptics/servo/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>

#include "module/haptics/servo/servo.h"
#include "module/haptics/servo/tick_bytes.h"
#include "tests/haptics/fuzz/recording_bytes.h"
#include "tests/haptics/servo/random_ticks.h"
#include "tests/haptics/servo/servo_fakes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class RecordingFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "palpate-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    path_ = folder_ / "a.ticks";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Writes n random ticks to the file; returns the bytes of the ticks alone.
  std::vector<std::string> write_random(uint64_t seed, int n, uint64_t lost = 0) {
    auto writer = RecordingWriter::create(path_, "heart, frames 4", 1'000'000);
    EXPECT_TRUE(writer) << writer.error().message;
    std::mt19937_64 random(seed);
    std::vector<std::string> ticks;
    TickInput input;
    TickOutput output;
    for (int k = 0; k < n; ++k) {
      test::random_tick(random, input, output);
      writer->hear(input, output);
      encode_tick(input, output, ticks.emplace_back());
    }
    EXPECT_TRUE(writer->finish(lost));
    return ticks;
  }
  std::string bytes() {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  std::string sentence(std::string changed) {
    const auto found = Recording::parse("a.ticks", std::move(changed));
    return found ? std::string() : found.error().message;
  }

  std::filesystem::path folder_, path_;
};

TEST_F(RecordingFile, GivesBackEveryBitOfEveryTick) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const auto ticks = write_random(seed, 200);
    auto recording = Recording::read(path_);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->scene(), "heart, frames 4");
    EXPECT_EQ(recording->period_ns(), 1'000'000);
    EXPECT_EQ(recording->ticks(), 200u);
    EXPECT_EQ(recording->lost(), 0u);
    TickInput input;
    TickOutput output;
    std::string again;
    for (size_t k = 0; k < ticks.size(); ++k) {
      ASSERT_TRUE(recording->next(input, output));
      again.clear();
      encode_tick(input, output, again);
      ASSERT_EQ(again, ticks[k]) << "seed " << seed << ", tick " << k;
    }
    EXPECT_FALSE(recording->next(input, output));
  }
}

// Version 1, from before grip and torque were kept, byte by byte as it was written.
TEST_F(RecordingFile, OfTheFirstVersionIsReadWithoutGripAndTorque) {
  std::string whole(kRecordingMagic);
  FieldEncoder encoder{whole};
  encoder.whole(uint32_t(1));
  encoder.whole(uint32_t(5));
  whole += "heart";
  encoder.whole(int64_t(1'000'000));
  std::mt19937_64 random(12);
  std::vector<std::string> ticks;
  for (int k = 0; k < 20; ++k) {
    TickInput input;
    TickOutput output;
    test::random_tick(random, input, output);
    whole += 'T';
    encoder.whole(uint8_t(input.pose_count));
    encoder.whole(uint8_t(input.event_count));
    visit_input(input, encoder);
    for (int p = 0; p < input.pose_count; ++p) visit_pose(input.poses[size_t(p)], encoder);
    for (int e = 0; e < input.event_count; ++e) visit_event(input.events[size_t(e)], encoder);
    visit_output(output, encoder);
    input.reading.grip = {};
    output.command.torque_n_m = {};
    encode_tick(input, output, ticks.emplace_back());
  }
  whole += 'E';
  encoder.whole(uint64_t(20));
  encoder.whole(uint64_t(0));
  encoder.whole(hash_on(kEmptyHash, whole));
  auto recording = Recording::parse("old.ticks", whole);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->scene(), "heart");
  TickInput input;
  TickOutput output;
  for (const std::string& tick : ticks) {
    ASSERT_TRUE(recording->next(input, output));
    std::string again;
    encode_tick(input, output, again);
    ASSERT_EQ(again, tick);
  }
  EXPECT_FALSE(recording->next(input, output));
}

TEST_F(RecordingFile, KeepsHowTheGripIsHeld) {
  TickInput input;
  input.reading.grip.turns = input.reading.grip.opens = true;
  input.reading.grip.device_from_grip = glm::angleAxis(0.7, glm::dvec3(0.0, 0.6, 0.8));
  input.reading.grip.angular_velocity_rad_per_s = {1.0, -2.0, 3.0};
  input.reading.grip.opening_rad = 0.25;
  auto writer = RecordingWriter::create(path_, "", 1'000'000);
  ASSERT_TRUE(writer);
  writer->hear(input, {});
  ASSERT_TRUE(writer->finish(0));
  auto recording = Recording::read(path_);
  ASSERT_TRUE(recording) << recording.error().message;
  TickInput read;
  TickOutput output;
  ASSERT_TRUE(recording->next(read, output));
  const GripReading &was = input.reading.grip, &is = read.reading.grip;
  EXPECT_TRUE(is.turns && is.opens);
  EXPECT_EQ(is.device_from_grip, was.device_from_grip);
  EXPECT_EQ(is.angular_velocity_rad_per_s, was.angular_velocity_rad_per_s);
  EXPECT_EQ(is.opening_rad, was.opening_rad);
}

TEST(TickBytes, AreLittleEndianWithoutGaps) {
  std::string bytes;
  TickInput input;
  input.dt_s = 1.0;
  input.now_ns = 0x0102030405060708;
  visit_input(input, FieldEncoder{bytes});
  EXPECT_EQ(bytes.size(), 8u + 8 + 24 + 8 + 4 + 1 + 1 + 1 + 1);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\0\0\0\0\0\0\xf0\x3f", 8));
  EXPECT_EQ(bytes.substr(8, 8), "\x08\x07\x06\x05\x04\x03\x02\x01");
}

TEST_F(RecordingFile, ThatWasCutOffIsReadAsFarAsItGoes) {
  const auto ticks = write_random(7, 3);
  const std::string whole = bytes();
  ASSERT_EQ(sentence(whole), "");
  EXPECT_THAT(sentence(""), HasSubstr("no recording"));
  const size_t first = whole.find(ticks[0]);
  ASSERT_NE(first, std::string::npos);
  std::vector<size_t> ends = {first};
  for (const std::string& tick : ticks) ends.push_back(ends.back() + tick.size());
  for (size_t size = 1; size < whole.size(); ++size) {
    auto recording = Recording::parse("cut", whole.substr(0, size));
    if (size < ends[1]) {
      ASSERT_FALSE(recording) << size;
      ASSERT_THAT(recording.error().message, HasSubstr("cut off")) << size;
      continue;
    }
    ASSERT_TRUE(recording) << size << ": " << recording.error().message;
    const auto after = std::upper_bound(ends.begin(), ends.end(), size);
    EXPECT_EQ(recording->ticks(), size_t(after - ends.begin()) - 1) << size;
    EXPECT_TRUE(recording->is_cut_off());
    TickInput input;
    TickOutput output;
    for (size_t k = 0; k < recording->ticks(); ++k) {
      ASSERT_TRUE(recording->next(input, output));
      std::string again;
      encode_tick(input, output, again);
      ASSERT_EQ(again, ticks[k]) << size;
    }
    EXPECT_FALSE(recording->next(input, output));
  }
  EXPECT_FALSE(Recording::parse("whole", whole)->is_cut_off());
}

TEST_F(RecordingFile, RefusesAnyFlippedByte) {
  write_random(8, 2);
  const std::string whole = bytes();
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = char(changed[at] ^ 0x10);
    ASSERT_NE(sentence(std::move(changed)), "") << "byte " << at;
  }
  EXPECT_THAT(sentence(whole + "x"), HasSubstr("damaged"));
}

TEST_F(RecordingFile, SaysWhatIsWrongWithForeignAndOtherVersions) {
  write_random(9, 1);
  EXPECT_THAT(sentence("NRRD0004\ntype: short\n"), HasSubstr("no recording of palpate"));
  std::string newer = bytes();
  newer[kRecordingMagic.size()] = 4;
  EXPECT_THAT(sentence(newer), HasSubstr("version 4, this program reads 1 to 3"));
  const auto missing = Recording::read(folder_ / "none");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("no such file"));
  EXPECT_FALSE(Recording::read(folder_));
  const auto nowhere = RecordingWriter::create(folder_ / "none" / "a", "", 1);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, ErrorKind::kBadOutput);
}

TEST_F(RecordingFile, SaysThatAFullDiskLostIt) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full here";
  auto writer = RecordingWriter::create("/dev/full", "", 1);
  ASSERT_TRUE(writer);
  const Status finished = writer->finish(0);
  ASSERT_FALSE(finished);
  EXPECT_THAT(finished.error().message, HasSubstr("disk"));
}

TEST_F(RecordingFile, HoldsAgainstDamage) {
  write_random(10, 3);
  const std::string whole = bytes();
  std::mt19937 random(20261121);
  for (int round = 0; round < 20'000; ++round) {
    std::string changed = whole;
    for (int n = 1 + int(random() % 3); n > 0; --n) {
      const size_t at = changed.empty() ? 0 : random() % changed.size();
      switch (random() % 4) {
        case 0:
          if (!changed.empty()) changed[at] = char(random());
          break;
        case 1:
          changed.resize(at);
          break;
        case 2:
          changed.erase(at, random() % 20);
          break;
        default:
          changed.insert(at, whole.substr(random() % whole.size(), random() % 400));
      }
    }
    fuzz::parse_recording(changed);
  }
}

/// A tick with state: its output depends on all inputs so far.
class Remembering : public Ticker {
 public:
  TickOutput tick(const TickInput& input) noexcept override {
    state_ = 0.9 * state_ + std::sin(input.reading.position_m.x + input.dt_s);
    for (int k = 0; k < input.event_count; ++k) state_ += input.events[size_t(k)].value;
    TickOutput output;
    output.command.force_n.x = input.stop ? 0.0 : state_;
    output.tank_j = std::exp(-state_ * state_);
    if (++ticks_ == disturbed_at) output.tank_j = std::nextafter(output.tank_j, 2.0);
    return output;
  }
  int disturbed_at = -1;

 private:
  double state_ = 0.0;
  int ticks_ = 0;
};

TEST_F(RecordingFile, OfARunningServoIsReplayedToTheSameBits) {
  test::FakeClock clock;
  test::FakeDevice device(clock);
  auto recorder = TickRecorder::start(path_, "test", 1'000'000);
  ASSERT_TRUE(recorder) << recorder.error().message;
  Remembering ticker;
  ServoPorts ports;
  ServoLoop loop(device, ticker, clock, ports, {}, {recorder->get(), nullptr});
  std::mt19937 random(3);
  device.answer = [&](DeviceReading& reading) {
    reading.position_m.x = double(random()) * 0x1p-32;
    reading.buttons = random() % 4;
  };
  // Fewer ticks than the ring can buffer: none is lost, however slow the disk is.
  constexpr int kTicks = 2000;
  for (int k = 0; k < kTicks; ++k) {
    if (k % 100 == 0) ports.events.push({ControlEvent::Kind::kModeGain, 0, 0.1 * k});
    if (k % 70 == 0) ports.poses.push({.volume = 0, .transform = {}, .time_ns = clock.now});
    if (k % 333 == 0) clock.oversleep_ns = 7'000'000;
    loop.run_period();
  }
  ASSERT_TRUE((*recorder)->finish());

  auto recording = Recording::read(path_);
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->ticks(), uint64_t(kTicks));
  Remembering again;
  const auto same = replay(*recording, again);
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(same->ticks, uint64_t(kTicks));
  EXPECT_EQ(same->different, 0u) << "first at tick " << same->first_different << ", "
                                 << same->first_field;
  // One changed bit in one field of one tick is detected and named.
  Remembering disturbed;
  disturbed.disturbed_at = 1234;
  const auto other = replay(*recording, disturbed);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->different, 1u);
  EXPECT_EQ(other->first_different, 1233);
  EXPECT_EQ(other->first_field, "tank");
}

TEST_F(RecordingFile, ThatLostTicksIsReadButNotReplayed) {
  write_random(11, 5, 3);
  auto recording = Recording::read(path_);
  ASSERT_TRUE(recording);
  EXPECT_EQ(recording->lost(), 3u);
  Remembering ticker;
  const auto replayed = replay(*recording, ticker);
  ASSERT_FALSE(replayed);
  EXPECT_THAT(replayed.error().message, HasSubstr("lacks 3 ticks"));
}

TEST_F(RecordingFile, WithoutAnEndIsCutOff) {
  {
    auto recorder = TickRecorder::start(path_, "test", 1'000'000);
    ASSERT_TRUE(recorder);
    (*recorder)->hear({}, {});
  }
  const auto recording = Recording::read(path_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_TRUE(recording->is_cut_off());
  EXPECT_EQ(recording->ticks(), 1U);
}

TEST_F(RecordingFile, CountsWhatTheRingCouldNotHold) {
  auto recorder = TickRecorder::start(path_, "test", 1'000'000);
  ASSERT_TRUE(recorder);
  // Faster than a writer thread that polls every 20 ms.
  for (int k = 0; k < 200'000; ++k) (*recorder)->hear({}, {});
  const uint64_t lost = (*recorder)->lost();
  ASSERT_TRUE((*recorder)->finish());
  auto recording = Recording::read(path_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->lost(), lost);
  EXPECT_EQ(recording->ticks() + recording->lost(), 200'000u);
}

}  // namespace
}  // namespace palpate
