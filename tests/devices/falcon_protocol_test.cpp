// The Falcon's packets: check values, a reference reader that reads all bytes at once, and bytes
// that are no packets.
#include "integration/devices/falcon_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace palpate::devices::falcon {
namespace {

using Bytes = std::vector<uint8_t>;

Bytes bytes_of(const char* text) {
  Bytes bytes;
  for (; *text; ++text) bytes.push_back(uint8_t(*text));
  return bytes;
}

/// An answer as the device writes it, built here from the description of the format.
Bytes written(const FalconAnswer& answer) {
  Bytes bytes = bytes_of("<");
  for (const int16_t count : answer.encoders) {
    int rest = count < 0 ? count + 65536 : count;
    for (int n = 0; n < 4; ++n, rest /= 16) bytes.push_back(uint8_t('A' + rest % 16));
  }
  bytes.push_back(uint8_t('A' + answer.buttons + 16 * answer.homed));
  bytes.push_back('A');
  bytes.push_back('>');
  return bytes;
}

void add(Bytes& to, const Bytes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

struct Found {
  std::vector<FalconAnswer> answers;
  uint64_t rejected = 0;
  size_t rest = 0;
  bool operator==(const Found&) const = default;
};

/// The definition, on all bytes at once.
Found reference(const Bytes& bytes) {
  Found found;
  size_t at = 0;
  while (at < bytes.size()) {
    if (bytes[at] != '<') {
      ++found.rejected;
      ++at;
      continue;
    }
    if (bytes.size() - at < kPacketBytes) break;
    bool legal = bytes[at + 15] == '>';
    for (size_t n = 1; n <= 12; ++n) legal &= bytes[at + n] >= 'A' && bytes[at + n] <= 'P';
    legal &= bytes[at + 13] >= 0x41 && bytes[at + 13] <= 0xc0;
    if (!legal) {
      ++found.rejected;
      ++at;
      continue;
    }
    FalconAnswer answer;
    for (size_t e = 0; e < 3; ++e) {
      int number = 0;
      for (size_t n = 4; n-- > 0;) number = 16 * number + (bytes[at + 1 + 4 * e + n] - 'A');
      answer.encoders[e] = int16_t(number >= 32768 ? number - 65536 : number);
    }
    answer.buttons = uint8_t((bytes[at + 13] - 'A') % 16);
    answer.homed = uint8_t((bytes[at + 13] - 'A') / 16);
    found.answers.push_back(answer);
    at += kPacketBytes;
  }
  found.rest = bytes.size() - at;
  return found;
}

std::string text(const Bytes& bytes) {
  std::string out;
  for (const uint8_t b : bytes) {
    char hex[4];
    std::snprintf(hex, sizeof hex, "%02x ", b);
    out += hex;
  }
  return out;
}

TEST(FalconProtocol, WritesACommandAsDescribed) {
  const Packet packet = encode({{-1447, 0, 4096}, kRed, true});
  // 0xFA59 is J F K P, least significant nibble first; 4096 = 0x1000; red 8 + homing 1.
  EXPECT_EQ(Bytes(packet.begin(), packet.end()), bytes_of("<JFKPAAAAAAABJA>"));
}

TEST(FalconProtocol, WritesEveryFlagAtItsBit) {
  EXPECT_EQ(encode({{}, kGreen, false})[13], 0x43);
  EXPECT_EQ(encode({{}, kBlue, false})[13], 0x45);
  EXPECT_EQ(encode({{}, kRed, false})[13], 0x49);
  EXPECT_EQ(encode({{}, kDark, true})[13], 0x42);
  EXPECT_EQ(encode({{}, uint8_t(kGreen | kBlue | kRed), true})[13], 0x50);
  EXPECT_EQ(encode({{}, 0xff, false})[13], 0x4f) << "lights must not change other bits";
}

TEST(FalconProtocol, NeverWritesABracketInsideACommand) {
  for (int number = -32768; number <= 32767; ++number) {
    const auto n = int16_t(number);
    const Packet packet = encode({{n, n, n}, uint8_t(kGreen | kBlue | kRed), true});
    ASSERT_EQ(packet.front(), '<');
    ASSERT_EQ(packet.back(), '>');
    for (size_t k = 1; k < 15; ++k) {
      ASSERT_GE(packet[k], 0x41) << number;
      ASSERT_LE(packet[k], 0x50) << number;
    }
  }
}

TEST(FalconProtocol, ReadsTheCheckValue) {
  AnswerStream stream;
  const Bytes bytes = {'<', 0x4a, 0x46, 0x4b, 0x50, 'A', 'A',
                       'A', 'A',  'P',  'P',  'P',  'P', 0x41 + 0x4 + 0x70,
                       'A', '>'};
  EXPECT_EQ(stream.read(bytes), 1);
  EXPECT_EQ(stream.newest(), (FalconAnswer{{-1447, 0, -1}, 0x4, kAllHomed}));
  EXPECT_EQ(stream.rejected_bytes(), 0U);
}

TEST(FalconProtocol, ReadsBackEveryNumber) {
  AnswerStream stream;
  for (int number = -32768; number <= 32767; ++number) {
    const FalconAnswer answer{{int16_t(number), int16_t(-number), int16_t(number / 2)},
                              uint8_t(number & 0xf),
                              uint8_t((number >> 4) & 0x7)};
    ASSERT_EQ(stream.read(written(answer)), 1) << number;
    ASSERT_EQ(stream.newest(), answer) << number;
  }
}

TEST(FalconProtocol, FindsAnswersInAnyStreamCutAnywhere) {
  for (uint32_t seed = 1; seed <= 3000; ++seed) {
    std::mt19937 random(seed);
    Bytes bytes;
    while (bytes.size() < 200) {
      Bytes piece = written({{int16_t(random()), int16_t(random()), int16_t(random())},
                             uint8_t(random() % 16),
                             uint8_t(random() % 8)});
      switch (random() % 6) {
        case 0:
          piece[random() % piece.size()] = uint8_t(random());
          break;
        case 1:
          piece.resize(random() % piece.size());
          break;
        case 2:
          piece.insert(piece.begin() + ptrdiff_t(random() % piece.size()),
                       random() % 2 ? '<' : '>');
          break;
        case 3:
          piece.assign(random() % 20, uint8_t(random() % 3 ? random() : '<'));
          break;
        default:
          break;
      }
      add(bytes, piece);
    }
    const Found expected = reference(bytes);
    AnswerStream stream;
    Found found;
    for (size_t at = 0; at < bytes.size();) {
      const size_t count = std::min<size_t>(1 + random() % 16, bytes.size() - at);
      if (stream.read(std::span(bytes).subspan(at, count)) > 0)
        // 16 bytes contain the end of at most one answer.
        found.answers.push_back(stream.newest());
      at += count;
    }
    ASSERT_EQ(found.answers, expected.answers) << "seed " << seed << ": " << text(bytes);
    ASSERT_EQ(stream.rejected_bytes(), expected.rejected) << "seed " << seed << ": " << text(bytes);
  }
}

TEST(FalconProtocol, CountsSeveralAnswersInOneReadAndKeepsTheNewest) {
  Bytes bytes = written({{1, 2, 3}, 0, 0});
  add(bytes, written({{4, 5, 6}, 1, 7}));
  AnswerStream stream;
  EXPECT_EQ(stream.read(bytes), 2);
  EXPECT_EQ(stream.newest(), (FalconAnswer{{4, 5, 6}, 1, 7}));
}

TEST(FalconProtocol, ForgetsAHalfReadAnswerWhenTold) {
  const Bytes bytes = written({{1, 2, 3}, 0, 0});
  AnswerStream stream;
  stream.read(std::span(bytes).first(9));
  stream.drop_rest();
  EXPECT_EQ(stream.read(std::span(bytes).subspan(9)), 0);
  EXPECT_EQ(stream.rejected_bytes(), 7U);
}

}  // namespace
}  // namespace palpate::devices::falcon
