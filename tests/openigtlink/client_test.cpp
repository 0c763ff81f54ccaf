// The client, with a server that makes every error a server can make.
#include "integration/openigtlink/client.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <stdexcept>
#include <thread>

#include "tests/openigtlink/wire.h"
#include "tests/support/wait_for.h"

namespace palpate::openigtlink {
namespace {

using test::Raw;
using test::WireHeader;
using test::WireImage;

/// What a client received.
class Heard {
 public:
  ClientOptions options() {
    ClientOptions options;
    options.transform = "Stylus";
    options.on_image = [this](ArrivedImage image) {
      const std::lock_guard lock(mutex_);
      images_.push_back(std::move(image));
    };
    options.on_transform = [this](const Rigid& rigid) {
      const std::lock_guard lock(mutex_);
      transforms_.push_back(rigid);
    };
    options.on_note = [this](const std::string& note) {
      const std::lock_guard lock(mutex_);
      notes_.push_back(note);
    };
    return options;
  }
  std::vector<ArrivedImage> images() const {
    const std::lock_guard lock(mutex_);
    return images_;
  }
  size_t transforms() const {
    const std::lock_guard lock(mutex_);
    return transforms_.size();
  }
  std::string notes() const {
    const std::lock_guard lock(mutex_);
    std::string all;
    for (const std::string& note : notes_) all += note + "\n";
    return all;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<ArrivedImage> images_;
  std::vector<Rigid> transforms_;
  std::vector<std::string> notes_;
};

class ClientTest : public testing::Test {
 protected:
  void start(ClientOptions options) {
    auto client = Client::start({"127.0.0.1", server_.port()}, std::move(options));
    ASSERT_TRUE(client) << client.error().message;
    client_ = std::move(*client);
    ASSERT_TRUE(server_.accept_one());
  }
  /// A whole image whose samples have one value.
  static Raw image(uint32_t seconds, uint8_t value, const std::string& device = "Probe") {
    WireImage wire;
    wire.samples = Raw(24, value);
    WireHeader header;
    header.seconds = seconds;
    header.device = device;
    return test::wire_message(header, wire.body());
  }
  bool came(size_t images) {
    return wait_for([&] { return heard_.images().size() >= images; });
  }
  uint64_t refused(const std::string& reason) {
    const auto numbers = client_->numbers();
    const auto found = numbers.refused.find(reason);
    return found == numbers.refused.end() ? 0 : found->second;
  }

  test::WireServer server_;
  Heard heard_;
  std::unique_ptr<Client> client_;
};

TEST_F(ClientTest, VersionsOneToThreeAreHeard) {
  start(heard_.options());
  WireImage wire;
  for (uint8_t version = 1; version <= 3; ++version) {
    wire.samples = Raw(24, version);
    WireHeader header;
    header.version = version;
    header.seconds = 100 + version;
    const Raw body = wire.body();
    ASSERT_TRUE(server_.send(test::wire_message(
        header, version == 1 ? body : test::extended(body, Raw(8, 3), Raw(30, 65)))));
  }
  ASSERT_TRUE(came(3));
  const auto images = heard_.images();
  for (uint8_t version = 1; version <= 3; ++version)
    EXPECT_EQ(images[version - 1].volume.values, std::vector<float>(24, float(version)));
  EXPECT_EQ(images[0].device, "Probe");
  EXPECT_DOUBLE_EQ(images[0].time_s, 101.5);
}

/// Each row is sent between two good images; both must arrive, and the error must be named.
TEST_F(ClientTest, WhatIsWrongIsLeftOutAndNamed) {
  start(heard_.options());
  WireImage other;
  other.samples = Raw(24, 77);
  WireHeader crc, colour_header, late, named, meta;
  crc.crc_error = 1;
  crc.seconds = late.seconds = 300;
  late.seconds = 99;
  colour_header.seconds = named.seconds = meta.seconds = 300;
  named.device = "Other";
  meta.version = 2;
  WireImage colour = other;
  colour.components = 3;
  colour.samples = Raw(72, 1);
  WireImage part = other;
  part.part = {2, 3, 2};
  part.size = {5, 3, 2};
  part.samples = Raw(12, 1);
  Raw lying = test::extended(other.body(), {}, {});
  // The metadata's size.
  lying[4] = 0xFF;
  const struct {
    const char* reason;
    Raw bytes;
  } rows[] = {
      {"damaged", test::wire_message(crc, other.body())},
      {"no image of a grid", test::wire_message(colour_header, colour.body())},
      {"late", test::wire_message(late, other.body())},
      {"image of another name", test::wire_message(named, other.body())},
      {"damaged", test::wire_message(meta, lying)},
      {"part alone", test::wire_message(colour_header, part.body())},
  };
  uint32_t seconds = 100;
  size_t good = 0;
  std::map<std::string, uint64_t> expected;
  ASSERT_TRUE(server_.send(image(seconds, 1)));
  ++good;
  for (const auto& row : rows) {
    SCOPED_TRACE(row.reason);
    ASSERT_TRUE(server_.send(row.bytes));
    ++seconds;
    ASSERT_TRUE(server_.send(image(seconds, uint8_t(seconds))));
    ++good;
    ASSERT_TRUE(came(good));
    EXPECT_EQ(heard_.images().back().volume.values[0], float(uint8_t(seconds)));
    EXPECT_EQ(refused(row.reason), ++expected[row.reason]);
  }
  ASSERT_TRUE(server_.send(image(seconds + 1, uint8_t(seconds))));
  ASSERT_TRUE(wait_for([&] { return refused("duplicate") == 1; }));
  EXPECT_EQ(heard_.images().size(), good);
  EXPECT_NE(heard_.notes().find("CRC"), std::string::npos);
  EXPECT_NE(heard_.notes().find("'Other'"), std::string::npos);
  EXPECT_EQ(client_->numbers().connections, 1u);
}

/// A sender that computes no CRC, among messages with a right and a wrong one.
TEST_F(ClientTest, MessagesWithoutACrcAreTakenWhereThatIsAskedFor) {
  for (const bool accepts : {false, true}) {
    SCOPED_TRACE(accepts);
    Heard heard;
    auto client = Client::start({"127.0.0.1", server_.port(), accepts}, heard.options());
    ASSERT_TRUE(client) << client.error().message;
    ASSERT_TRUE(server_.accept_one());
    WireImage wire;
    wire.coordinates = 0;
    wire.samples = Raw(24, 7);
    WireHeader none, wrong;
    none.seconds = wrong.seconds = 300;
    none.crc_error = test::wire_crc(wire.body());
    wrong.crc_error = 1;
    ASSERT_TRUE(server_.send(test::wire_message(none, wire.body())));
    ASSERT_TRUE(server_.send(test::wire_message(none, wire.body())));
    ASSERT_TRUE(server_.send(test::wire_message(wrong, wire.body())));
    ASSERT_TRUE(server_.send(image(301, 9)));
    const size_t images = accepts ? 3 : 1;
    ASSERT_TRUE(wait_for([&] { return heard.images().size() == images; }));
    EXPECT_EQ(heard.images().back().volume.values[0], 9.0F);
    const auto refused = (*client)->numbers().refused;
    EXPECT_EQ(refused.at("damaged"), 1U);
    EXPECT_EQ(refused.contains("no CRC"), !accepts);
    EXPECT_EQ(heard.notes().find("accept them by ?crc=none") == std::string::npos, accepts);
    EXPECT_EQ(heard.notes().find("taken for RAS") == std::string::npos, !accepts);
  }
}

TEST_F(ClientTest, APartIsPutIntoTheWholeThatCameBefore) {
  start(heard_.options());
  ASSERT_TRUE(server_.send(image(100, 5)));
  WireImage part;
  part.first = {1, 2, 1};
  part.part = {2, 1, 1};
  part.samples = {8, 9};
  WireHeader header;
  header.seconds = 101;
  ASSERT_TRUE(server_.send(test::wire_message(header, part.body())));
  ASSERT_TRUE(came(2));
  std::vector<float> expected(24, 5.0f);
  expected[1 + 4 * (2 + 3 * 1)] = 8.0f;
  expected[2 + 4 * (2 + 3 * 1)] = 9.0f;
  EXPECT_EQ(heard_.images().back().volume.values, expected);
}

/// The largest memory use of this process so far.
long most_kb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

/// Messages claim 1 GiB of samples and have one: no memory is allocated for the rest, and they are
/// left out, as no whole image came before them.
TEST_F(ClientTest, PartsOfAHugeImageTakeNoMemory) {
  start(heard_.options());
  const long before_kb = most_kb();
  WireImage part;
  part.size = {1024, 1024, 1024};
  part.part = {1, 1, 1};
  for (int n = 0; n < 6; ++n) {
    part.first = {n, 7, 9};
    part.samples = {uint8_t(n)};
    ASSERT_TRUE(server_.send(test::wire_message({}, part.body())));
  }
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(came(1));
  EXPECT_EQ(refused("part alone"), 6u);
  EXPECT_LT(most_kb() - before_kb, 100'000);
}

/// An exception on the client's thread, also for lack of memory, ends the connection, not the
/// program.
TEST_F(ClientTest, AnExceptionIsSaidAndTheConnectionIsMadeAnew) {
  ClientOptions options = heard_.options();
  int images = 0;
  options.on_image = [&, take = options.on_image](ArrivedImage image) {
    if (++images == 1) throw std::bad_alloc();
    if (images == 2) throw std::runtime_error("no place for it");
    take(std::move(image));
  };
  start(options);
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(server_.accept_one());
  EXPECT_EQ(refused("out of memory"), 1u);
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(server_.accept_one());
  EXPECT_EQ(refused("failed"), 1u);
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(came(1));
  const std::string notes = heard_.notes();
  for (const char* said : {"Memory ran out", "no place for it", "has ended: connecting again"})
    EXPECT_NE(notes.find(said), std::string::npos) << said << " is not in:\n" << notes;
}

/// Notes are for the user: a note that can not be shown must not end the connection.
TEST_F(ClientTest, WhoHearsTheNotesMayThrow) {
  ClientOptions options = heard_.options();
  options.on_note = [](const std::string&) { throw std::runtime_error("no console"); };
  start(options);
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(came(1));
  EXPECT_EQ(client_->numbers().connections, 1u);
}

/// As 2D ultrasound is sent: each image is a picture at the probe's place. No program makes a
/// volume of them here.
TEST_F(ClientTest, FlatImagesAreSaidOnceAndTheRestGoesOn) {
  start(heard_.options());
  for (uint8_t n = 0; n < 5; ++n) {
    WireImage flat;
    flat.size = flat.part = {4, 3, 1};
    flat.matrix[11] = float(n);
    flat.samples = Raw(12, n);
    WireHeader header;
    header.seconds = 100 + n;
    header.device = "Ultrasound";
    ASSERT_TRUE(server_.send(test::wire_message(header, flat.body())));
  }
  // The same sender also sends the volume that it makes of them, and this one is used.
  ASSERT_TRUE(server_.send(image(105, 1, "Reconstructed")));
  ASSERT_TRUE(came(1));
  EXPECT_EQ(heard_.images().front().device, "Reconstructed");
  EXPECT_EQ(refused("flat image"), 5u);
  EXPECT_EQ(client_->numbers().connections, 1u);
  const std::string notes = heard_.notes();
  const std::string said = "The images of 'Ultrasound' are flat (4 x 3 x 1 samples)";
  ASSERT_NE(notes.find(said), std::string::npos) << notes;
  EXPECT_EQ(notes.find(said), notes.rfind(said)) << notes;
}

TEST_F(ClientTest, LeftHandedSamplesAreTurnedWithTheirGrid) {
  start(heard_.options());
  WireImage wire;
  wire.matrix = {1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0};
  ASSERT_TRUE(server_.send(test::wire_message({}, wire.body())));
  ASSERT_TRUE(came(1));
  const Volume volume = heard_.images().front().volume;
  // The message's sample (0, 0, 0), of value 0, is at RAS (-1.5, 1, -0.5), LPS (1.5, -1, -0.5).
  const glm::dvec3 index = volume.grid.index_from_lps({1.5, -1.0, -0.5});
  EXPECT_LT(glm::length(index - glm::dvec3(0, 2, 0)), 1e-5);
  EXPECT_EQ(volume.at(0, 2, 0), 0.0f);
  EXPECT_EQ(volume.at(3, 0, 1), float(3 + 4 * (2 + 3)));
}

/// After these errors the place of the next message is unknown, so the client connects again.
TEST_F(ClientTest, AStreamThatIsBrokenIsLeftAndFoundAgain) {
  start(heard_.options());
  const Raw whole = image(100, 1);
  WireHeader huge, version, type, transform;
  huge.body_bytes = int64_t(1) << 62;
  version.version = 9;
  type.type = "im age";
  transform.type = "TRANSFORM";
  transform.body_bytes = 1 << 30;
  const Raw rows[] = {test::wire_message(huge, {}), test::wire_message(version, {}),
                      test::wire_message(type, {}), test::wire_message(transform, {}),
                      Raw(500, 'x')};
  size_t good = 0;
  for (const Raw& row : rows) {
    ASSERT_TRUE(server_.send(row));
    ASSERT_TRUE(server_.accept_one());
    ASSERT_TRUE(server_.send(image(100, uint8_t(++good))));
    ASSERT_TRUE(came(good));
  }
  EXPECT_EQ(refused("no OpenIGTLink"), std::size(rows));
  // The connection ends in the middle of a message, and then another time before any byte.
  ASSERT_TRUE(server_.send(Raw(whole.begin(), whole.end() - 7)));
  server_.drop();
  ASSERT_TRUE(server_.accept_one());
  ASSERT_TRUE(server_.send(image(100, 42)));
  ASSERT_TRUE(came(++good));
  EXPECT_EQ(refused("torn"), 1u);
  ASSERT_TRUE(server_.send(Raw(whole.begin(), whole.end() - 7)));
  // 3 s later, by itself.
  ASSERT_TRUE(server_.accept_one());
  EXPECT_EQ(refused("torn"), 2u);
}

TEST_F(ClientTest, AServerThatWasAwayIsFoundAgain) {
  start(heard_.options());
  ASSERT_TRUE(server_.send(image(500, 1)));
  ASSERT_TRUE(came(1));
  server_.go_away();
  ASSERT_TRUE(wait_for([&] { return !client_->is_connected(); }));
  server_.come_back();
  ASSERT_TRUE(server_.accept_one());
  // Its clock started again, and it sends its last image.
  ASSERT_TRUE(server_.send(image(3, 1)));
  ASSERT_TRUE(came(2));
  EXPECT_NE(heard_.notes().find("connecting again"), std::string::npos);
}

TEST_F(ClientTest, TransformsOfTheNameAskedForAreTaken) {
  start(heard_.options());
  Raw body;
  for (const float f : {1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 10.f, 20.f, 30.f})
    test::put_float(body, f);
  WireHeader header;
  header.type = "TRANSFORM";
  header.device = "Stylus";
  ASSERT_TRUE(server_.send(test::wire_message(header, body)));
  header.device = "Needle";
  ASSERT_TRUE(server_.send(test::wire_message(header, body)));
  body[0] = 0x7F;
  body[1] = 0xC0;  // NaN
  header.device = "Stylus";
  ASSERT_TRUE(server_.send(test::wire_message(header, body)));
  // Ignored, whatever it contains.
  header.type = "POLYDATA";
  ASSERT_TRUE(server_.send(test::wire_message(header, Raw(100'000, 1))));
  ASSERT_TRUE(server_.send(image(100, 1)));
  ASSERT_TRUE(came(1));
  EXPECT_EQ(heard_.transforms(), 1u);
  EXPECT_EQ(refused("transform of another name"), 1u);
  EXPECT_EQ(refused("no rigid transform"), 1u);
}

TEST_F(ClientTest, EndsAtOnceWhateverTheServerDoes) {
  start(heard_.options());
  const Raw whole = image(100, 1);
  ASSERT_TRUE(server_.send(Raw(whole.begin(), whole.begin() + 70)));
  // Hangs, and the test with it, if it waits for the rest.
  client_.reset();
}

TEST(Places, AreReadOrRefused) {
  const auto plain = read_address("igtl://heart.local");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->host, "heart.local");
  EXPECT_EQ(plain->port, 18944);
  const auto six = read_address("igtl://[::1]:18945/");
  ASSERT_TRUE(six);
  EXPECT_EQ(six->host, "::1");
  EXPECT_EQ(six->port, 18945);
  EXPECT_FALSE(six->accepts_no_crc);
  for (const char* open : {"igtl://a?crc=none", "igtl://a:18944?crc=none", "igtl://a/?crc=none"}) {
    const auto place = read_address(open);
    ASSERT_TRUE(place) << open;
    EXPECT_EQ(place->host, "a");
    EXPECT_TRUE(place->accepts_no_crc);
  }
  for (const char* wrong : {"igtl://a?crc=no", "igtl://a?none", "igtl://?crc=none", "igtl://",
                            "igtl://:18944", "igtl://a:0", "igtl://a:65536",
                            "igtl://a:", "igtl://a:1x", "igtl://[::1", "igtl://a/b", "http://a"})
    EXPECT_FALSE(read_address(wrong)) << wrong;
}

}  // namespace
}  // namespace palpate::openigtlink
