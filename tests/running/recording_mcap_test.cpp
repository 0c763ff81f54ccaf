// A recording as MCAP. Read by a reader written here from the specification, which checks every
// length, index and CRC; and by the format's own JavaScript reader where it is installed.
#include "integration/running/recording_mcap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "integration/files/mcap.h"
#include "module/haptics/servo/recording.h"
#include "tests/files/temporary_folder.h"

namespace palpate::running {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A part of a file, read from its start.
struct McapBytes {
  std::string_view bytes;
  size_t at = 0;
  template <class Whole>
  Whole whole() {
    if (bytes.size() - at < sizeof(Whole)) throw std::runtime_error("too short");
    Whole value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  }
  std::string_view take(size_t n) {
    if (bytes.size() - at < n) throw std::runtime_error("too short");
    at += n;
    return bytes.substr(at - n, n);
  }
  std::string_view text() { return take(whole<uint32_t>()); }
  bool done() const { return at == bytes.size(); }
};

uint32_t crc_of(std::string_view bytes) {
  return uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

struct ReadMessage {
  uint32_t sequence;
  uint64_t time_ns;
  std::string bytes;
};

/// What is in an MCAP file. Throws where it does not follow the specification.
struct ReadMcap {
  explicit ReadMcap(std::string_view all) {
    const std::string_view magic("\x89MCAP0\r\n", 8);
    expect(all.starts_with(magic) && all.ends_with(magic), "magic");
    McapBytes file{all.substr(0, all.size() - 8), 8};
    expect(file.whole<uint8_t>() == 1, "header first");
    McapBytes header{file.take(file.whole<uint64_t>())};
    expect(header.text() == "ros2", "profile");
    size_t data_end = 0, footer_at = 0;
    while (!file.done()) {
      const size_t at = file.at;
      const auto kind = file.whole<uint8_t>();
      McapBytes record{file.take(file.whole<uint64_t>())};
      switch (kind) {
        case 2: {
          footer_at = at;
          summary_at = record.whole<uint64_t>();
          offsets_at = record.whole<uint64_t>();
          expect(
              record.whole<uint32_t>() == crc_of(all.substr(summary_at, file.at - 4 - summary_at)),
              "summary crc");
          break;
        }
        case 3:
        case 4:
          define(kind, record, data_end != 0);
          break;
        case 6:
          chunk(record, at);
          break;
        case 7: {
          const auto channel = record.whole<uint16_t>();
          McapBytes entries{record.text()};
          while (!entries.done()) {
            const auto time_ns = entries.whole<uint64_t>();
            const auto place = entries.whole<uint64_t>();
            McapBytes message{last_chunk, place};
            expect(message.whole<uint8_t>() == 5, "index");
            message.whole<uint64_t>();
            expect(message.whole<uint16_t>() == channel, "index of its channel");
            message.whole<uint32_t>();
            expect(message.whole<uint64_t>() == time_ns, "time in the index");
            ++indexed;
          }
          index_places[at] = channel;
          break;
        }
        case 8: {
          record.take(16);
          expect(chunks.count(record.whole<uint64_t>()) == 1, "chunk index");
          record.whole<uint64_t>();
          McapBytes places{record.text()};
          while (!places.done()) {
            const auto channel = places.whole<uint16_t>();
            expect(index_places.at(places.whole<uint64_t>()) == channel, "message index");
          }
          ++indexed_chunks;
          break;
        }
        case 11:
          counted = record.whole<uint64_t>();
          break;
        case 14: {
          const auto group = record.whole<uint8_t>();
          const auto start = record.whole<uint64_t>();
          const auto length = record.whole<uint64_t>();
          expect(uint8_t(all[start]) == group && start + length <= offsets_or(at), "group");
          break;
        }
        case 15:
          data_end = at;
          expect(record.whole<uint32_t>() == crc_of(all.substr(0, at)), "data crc");
          break;
        default:
          expect(false, "record " + std::to_string(kind));
      }
    }
    expect(footer_at > 0 && summary_at == data_end + 13, "places of the summary");
    expect(indexed_chunks == chunks.size(), "all chunks");
    expect(uint8_t(all[offsets_at]) == 14, "summary offsets");
  }

  static void expect(bool holds, const std::string& what) {
    if (!holds) throw std::runtime_error("wrong: " + what);
  }
  size_t offsets_or(size_t at) const { return offsets_at ? offsets_at : at; }
  void define(uint8_t kind, McapBytes& record, bool again) {
    const auto id = record.whole<uint16_t>();
    if (kind == 3) {
      const std::string name(record.text());
      expect(record.text() == "ros2msg", "encoding");
      if (again) expect(schemas.at(id).first == name, "schema in the summary");
      schemas[id] = {name, std::string(record.text())};
    } else {
      const auto schema = record.whole<uint16_t>();
      const std::string topic(record.text());
      expect(record.text() == "cdr" && schemas.count(schema) == 1, "channel");
      if (again) expect(topics.at(id) == topic, "channel in the summary");
      topics[id] = topic;
      schema_of[topic] = schemas[schema].first;
    }
  }
  void chunk(McapBytes& record, size_t at) {
    const auto start = record.whole<uint64_t>(), end = record.whole<uint64_t>();
    const auto size = record.whole<uint64_t>();
    const auto crc = record.whole<uint32_t>();
    expect(record.text().empty() && record.whole<uint64_t>() == size, "no compression");
    last_chunk = std::string(record.take(size));
    expect(record.done() && crc_of(last_chunk) == crc, "chunk crc");
    McapBytes inside{last_chunk};
    while (!inside.done()) {
      const auto kind = inside.whole<uint8_t>();
      McapBytes one{inside.take(inside.whole<uint64_t>())};
      if (kind != 5) {
        define(kind, one, false);
        continue;
      }
      const std::string topic = topics.at(one.whole<uint16_t>());
      ReadMessage message;
      message.sequence = one.whole<uint32_t>();
      message.time_ns = one.whole<uint64_t>();
      expect(one.whole<uint64_t>() == message.time_ns, "publish time");
      expect(start <= message.time_ns && message.time_ns <= end, "time in its chunk");
      message.bytes = std::string(one.take(one.bytes.size() - one.at));
      messages[topic].push_back(message);
    }
    chunks[at] = size;
  }

  std::map<uint16_t, std::pair<std::string, std::string>> schemas;
  std::map<uint16_t, std::string> topics;
  std::map<std::string, std::string> schema_of;
  std::map<std::string, std::vector<ReadMessage>> messages;
  std::map<size_t, uint64_t> chunks;
  std::map<size_t, uint16_t> index_places;
  std::string last_chunk;
  uint64_t indexed = 0, counted = 0, indexed_chunks = 0;
  size_t summary_at = 0, offsets_at = 0;
};

/// The numbers of a stamped message, behind its stamp and frame.
struct ReadStamped {
  explicit ReadStamped(const std::string& bytes) {
    McapBytes cdr{std::string_view(bytes).substr(4)};
    EXPECT_EQ(bytes.substr(0, 4), std::string("\0\1\0\0", 4));
    time_ns = cdr.whole<uint32_t>() * uint64_t(1'000'000'000);
    time_ns += cdr.whole<uint32_t>();
    frame = cdr.text();
    EXPECT_EQ(frame.back(), '\0');
    frame.pop_back();
    cdr.at = (cdr.at + 7) / 8 * 8;
    while (!cdr.done()) numbers.push_back(cdr.whole<double>());
  }
  uint64_t time_ns;
  std::string frame;
  std::vector<double> numbers;
};

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

constexpr int kTicks = 5000;  // several chunks

TickInput input_of(int k) {
  TickInput input;
  input.now_ns = 3'999'000'000 + k * 1'000'000;
  input.reading.position_m = {1e-4 * k, 0.02, -0.03};
  input.reading.grip.turns = true;
  input.reading.grip.device_from_grip = glm::angleAxis(1e-3 * k, glm::dvec3(0.0, 1.0, 0.0));
  return input;
}

TickOutput output_of(int k) {
  TickOutput output;
  output.command.force_n = {0.5, 1e-3 * k, -0.25};
  output.wanted_n = {1.0, 2e-3 * k, -0.5};
  output.probe_m = {2e-4 * k, 0.04, -0.06};
  output.proxy_m = {0.1, 0.2, 0.3};
  output.cause = k < 100 ? Cause::kStarting : Cause::kNone;
  return output;
}

class RecordingMcap : public ::testing::Test {
 protected:
  void SetUp() override {
    auto writer = RecordingWriter::create(recording(), "{}", 1'000'000);
    ASSERT_TRUE(writer) << writer.error().message;
    for (int k = 0; k < kTicks; ++k) writer->hear(input_of(k), output_of(k));
    ASSERT_TRUE(writer->finish(0));
  }
  fs::path recording() const { return folder_.path() / "a.ticks"; }
  fs::path mcap() const { return folder_.path() / "a.mcap"; }
  files::TemporaryFolder folder_;
};

TEST_F(RecordingMcap, HasEveryTickInMessagesOfRos) {
  const auto ticks = write_mcap(recording(), mcap());
  ASSERT_TRUE(ticks) << ticks.error().message;
  EXPECT_EQ(*ticks, uint64_t(kTicks));
  const ReadMcap read(bytes_of(mcap()));
  EXPECT_GT(read.chunks.size(), 2u);
  EXPECT_EQ(read.counted, 5u * kTicks + 2);
  EXPECT_EQ(read.indexed, read.counted);
  EXPECT_EQ(read.schemas.size(), 3u);
  for (const char* topic : {"/palpate/hand", "/palpate/probe", "/palpate/proxy"})
    EXPECT_EQ(read.schema_of.at(topic), "geometry_msgs/msg/PoseStamped") << topic;
  for (const char* topic : {"/palpate/force", "/palpate/scene_force"})
    EXPECT_EQ(read.schema_of.at(topic), "geometry_msgs/msg/WrenchStamped") << topic;
  for (const auto& [id, schema] : read.schemas)
    if (schema.first != "std_msgs/msg/String") {
      EXPECT_THAT(schema.second, HasSubstr("MSG: std_msgs/Header"));
      EXPECT_THAT(schema.second, HasSubstr("MSG: builtin_interfaces/Time"));
    }
  for (const int k : {0, 1, 1234, kTicks - 1}) {
    const TickInput input = input_of(k);
    const TickOutput output = output_of(k);
    const auto at = [&](const char* topic) {
      const ReadMessage& message = read.messages.at(topic)[size_t(k)];
      EXPECT_EQ(message.sequence, uint32_t(k));
      EXPECT_EQ(message.time_ns, uint64_t(input.now_ns));
      ReadStamped stamped(message.bytes);
      EXPECT_EQ(stamped.time_ns, uint64_t(input.now_ns));
      return stamped;
    };
    const ReadStamped hand = at("/palpate/hand"), proxy = at("/palpate/proxy");
    const glm::dquat q = input.reading.grip.device_from_grip;
    EXPECT_EQ(hand.frame, "device");
    EXPECT_EQ(hand.numbers, (std::vector<double>{1e-4 * k, 0.02, -0.03, q.x, q.y, q.z, q.w}));
    EXPECT_EQ(proxy.frame, "world");
    EXPECT_EQ(proxy.numbers, (std::vector<double>{0.1, 0.2, 0.3, 0, 0, 0, 1}));
    EXPECT_EQ(at("/palpate/probe").numbers[0], output.probe_m.x);
    EXPECT_EQ(at("/palpate/force").numbers,
              (std::vector<double>{0.5, output.command.force_n.y, -0.25, 0, 0, 0}));
    EXPECT_EQ(at("/palpate/scene_force").numbers[1], output.wanted_n.y);
  }
  const auto& causes = read.messages.at("/palpate/cause");
  ASSERT_EQ(causes.size(), 2u);
  EXPECT_EQ(causes[0].bytes, std::string("\0\1\0\0\x9\0\0\0starting\0", 17));
  EXPECT_EQ(causes[1].time_ns, uint64_t(input_of(100).now_ns));
}

TEST_F(RecordingMcap, IsReadByTheFormatsOwnReader) {
  if (std::system("node --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "There is no node here.";
  ASSERT_TRUE(write_mcap(recording(), mcap()));
  const std::string script = std::string(PALPATE_SOURCE_DIR) + "/tests/running/read_mcap.mjs";
  const std::string said = (folder_.path() / "said").string();
  const int status =
      std::system(("node " + script + " " + mcap().string() + " > " + said + " 2>&1").c_str());
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "The npm package @mcap/core is not installed.";
  EXPECT_EQ(status, 0) << bytes_of(said);
  EXPECT_EQ(bytes_of(said),
            "ros2: 25002 messages, /palpate/cause 2, /palpate/force 5000, /palpate/hand 5000, "
            "/palpate/probe 5000, /palpate/proxy 5000, /palpate/scene_force 5000\n");
}

TEST_F(RecordingMcap, IsRefusedWithASentence) {
  const auto missing = write_mcap(folder_.path() / "none.ticks", mcap());
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::kBadInput);
  EXPECT_FALSE(fs::exists(mcap()));
  const auto nowhere = write_mcap(recording(), folder_.path() / "none" / "a.mcap");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, ErrorKind::kBadOutput);
}

}  // namespace
}  // namespace palpate::running
