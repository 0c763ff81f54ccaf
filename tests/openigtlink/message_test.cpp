// Messages as bytes. wire.h writes the bytes by the protocol's documents.
#include "integration/openigtlink/message.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/openigtlink/wire.h"

namespace palpate::openigtlink {
namespace {

using test::Raw;
using test::WireHeader;
using test::WireImage;

std::span<const std::byte> bytes(const Raw& raw) {
  return std::as_bytes(std::span(raw));
}

Result<ImageMessage> image_of(const WireImage& wire) {
  return read_image(bytes(wire.body()));
}

TEST(Messages, CrcIsTheOneOfTheProtocol) {
  // The check value of CRC-64/ECMA-182.
  const std::string text = "123456789";
  EXPECT_EQ(crc64(std::as_bytes(std::span(text))), 0x6C40DF5F0B497347ULL);
}

/// 3 x 4 x 5 samples of 1 x 2 x 3 mm, rotated by 90 degrees about S: i points to A, j to L (-R), k
/// to S. The middle is at RAS (10, 20, 30). Computed by hand: the first sample is at
///   RAS = (10, 20, 30) - 1 (0, 1, 0) - 3 (-1, 0, 0) - 6 (0, 0, 1) = (13, 19, 24),
/// LPS = (-13, -19, 24); sample (2, 1, 4) at RAS (13, 19, 24) + 2 (0, 1, 0) + 2 (-1, 0, 0) + 12 (0,
/// 0, 1).
TEST(Messages, AnObliqueAnisotropicImageLiesWhereTheDocumentsSay) {
  WireImage wire;
  wire.size = wire.part = {3, 4, 5};
  wire.matrix = {0, 1, 0, -2, 0, 0, 0, 0, 3, 10, 20, 30};
  const auto image = image_of(wire);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_FALSE(image->j_reversed);
  EXPECT_TRUE(image->is_whole());
  EXPECT_EQ(image->grid.spacing_mm, glm::dvec3(1, 2, 3));
  EXPECT_LT(glm::length(image->grid.origin_mm - glm::dvec3(-13, -19, 24)), 1e-5);
  EXPECT_LT(glm::length(image->grid.lps_from_index({2, 1, 4}) - glm::dvec3(-11, -21, 36)), 1e-5);
  EXPECT_FLOAT_EQ(image->values[size_t(2 + 3 * (1 + 4 * 4))], float(2 + 3 * (1 + 4 * 4)));
}

TEST(Messages, ACoordinateSystemThatIsLeftOpenIsRas) {
  WireImage said, open;
  said.matrix = open.matrix = {0, 1, 0, -2, 0, 0, 0, 0, 3, 10, 20, 30};
  open.coordinates = 0;
  const auto with = image_of(said), without = image_of(open);
  ASSERT_TRUE(with && without);
  EXPECT_FALSE(with->is_ras_assumed);
  EXPECT_TRUE(without->is_ras_assumed);
  EXPECT_TRUE(same_geometry(with->grid, without->grid));
}

TEST(Messages, LpsOnTheWireIsLps) {
  WireImage wire;
  wire.coordinates = 2;
  wire.matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1, 10, 20, 30};
  const auto image = image_of(wire);
  ASSERT_TRUE(image);
  EXPECT_LT(glm::length(image->grid.origin_mm - glm::dvec3(8.5, 19, 29.5)), 1e-5);
}

TEST(Messages, LeftHandedAxesAreTurnedRight) {
  WireImage wire;
  wire.matrix = {1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0};
  const auto image = image_of(wire);
  ASSERT_TRUE(image);
  EXPECT_TRUE(image->j_reversed);
  EXPECT_GT(glm::determinant(image->grid.direction), 0.99);
  // In RAS the middle is at 0; i points to R, and the grid's j, which is reversed, to A.
  EXPECT_LT(glm::length(image->grid.lps_from_index({0, 0, 0}) - glm::dvec3(1.5, 1, -0.5)), 1e-5);
}

TEST(Messages, EveryScalarTypeAndBothEndiansAreRead) {
  struct Row {
    int type, endian;
    /// The value below.
    Raw one;
    float value;
  };
  const Row rows[] = {{2, 1, {0xFE}, -2.0f},
                      {3, 2, {0xFE}, 254.0f},
                      {4, 1, {0xFF, 0x38}, -200.0f},
                      {4, 2, {0x38, 0xFF}, -200.0f},
                      {5, 2, {0x38, 0xFF}, 65336.0f},
                      {6, 1, {0xFF, 0xFF, 0xFF, 0x38}, -200.0f},
                      {7, 2, {0x00, 0x00, 0x01, 0x00}, 65536.0f},
                      {10, 1, {0xBF, 0xC0, 0x00, 0x00}, -1.5f},
                      {10, 2, {0x00, 0x00, 0xC0, 0xBF}, -1.5f},
                      {11, 1, {0xBF, 0xF8, 0, 0, 0, 0, 0, 0}, -1.5f},
                      {11, 2, {0, 0, 0, 0, 0, 0, 0xF8, 0xBF}, -1.5f}};
  for (const Row& row : rows) {
    SCOPED_TRACE(testing::Message() << "type " << row.type << " endian " << row.endian);
    WireImage wire;
    wire.scalar_type = row.type;
    wire.endian = row.endian;
    for (int n = 0; n < 24; ++n)
      wire.samples.insert(wire.samples.end(), row.one.begin(), row.one.end());
    const auto image = image_of(wire);
    ASSERT_TRUE(image) << image.error().message;
    for (const float value : image->values) EXPECT_EQ(value, row.value);
  }
}

TEST(Messages, WhatIsNoImageIsRefusedBeforeItsSamplesAreTaken) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto with = [](auto change) {
    WireImage wire;
    change(wire);
    return wire;
  };
  const struct {
    const char* name;
    WireImage wire;
    const char* word;
  } rows[] = {
      {"a colour image", with([](auto& w) { w.components = 3; }), "values per sample"},
      {"no scalar type", with([](auto& w) { w.scalar_type = 9; }), "scalar type 9"},
      {"no endianness", with([](auto& w) { w.endian = 0; }), "endianness"},
      {"no coordinates", with([](auto& w) { w.coordinates = 7; }), "coordinate"},
      {"larger than its body", with([](auto& w) {
         w.size = w.part = {1000, 1000, 1000};
         w.samples = {1};
       }),
       "bytes of them"},
      {"too many samples", with([](auto& w) {
         w.size = w.part = {65535, 65535, 65535};
         w.samples = {1};
       }),
       "along each axis"},
      {"flat", with([](auto& w) {
         w.size = w.part = {24, 1, 1};
       }),
       "along each axis"},
      {"nothing", with([](auto& w) {
         w.part = {0, 3, 2};
         w.samples = {1};
       }),
       "part"},
      {"a part outside", with([](auto& w) {
         w.first = {1, 0, 0};
       }),
       "part"},
      {"NaN in the matrix", with([&](auto& w) { w.matrix[4] = nan; }), "not finite"},
      {"NaN in its place", with([&](auto& w) { w.matrix[10] = nan; }), "not finite"},
      {"zero spacing", with([](auto& w) { w.matrix[0] = 0; }), "mm apart"},
      {"sheared", with([](auto& w) { w.matrix[1] = 0.5f; }), "right angles"},
      {"far away", with([](auto& w) { w.matrix[9] = 1e6f; }), "10 m"},
      {"one sample too few", with([](auto& w) { w.samples = Raw(23); }), "bytes of them"},
      {"one sample too many", with([](auto& w) { w.samples = Raw(25); }), "bytes of them"},
  };
  for (const auto& row : rows) {
    const auto image = image_of(row.wire);
    ASSERT_FALSE(image) << row.name;
    EXPECT_NE(image.error().message.find(row.word), std::string::npos)
        << row.name << ": " << image.error().message;
  }
  WireImage real;
  real.scalar_type = 10;
  for (int n = 0; n < 24; ++n) {
    const Raw one = n == 5 ? Raw{0, 0, 0xC0, 0x7F} : Raw{0, 0, 0, 0};
    real.samples.insert(real.samples.end(), one.begin(), one.end());
  }
  ASSERT_FALSE(image_of(real));
  EXPECT_FALSE(read_image(bytes(Raw(71))));
}

/// i to A, j to L, k to S is a quarter turn about S. RAS (10, 20, 30) is LPS (-10, -20, 30).
TEST(Messages, ATransformIsATurnAndAWayInLps) {
  Raw body;
  for (const float f : {0.f, 1.f, 0.f, -1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 10.f, 20.f, 30.f})
    test::put_float(body, f);
  const auto rigid = read_transform(bytes(body));
  ASSERT_TRUE(rigid) << rigid.error().message;
  EXPECT_LT(glm::length(rigid->translation_mm - glm::dvec3(-10, -20, 30)), 1e-6);
  // The point RAS (1, 0, 0) = LPS (-1, 0, 0) goes to RAS (0, 1, 0) = LPS (0, -1, 0).
  EXPECT_LT(glm::length(rigid->rotation * glm::dvec3(-1, 0, 0) - glm::dvec3(0, -1, 0)), 1e-6);
  const auto again = write_transform("T", 1.5, *rigid);
  EXPECT_TRUE(std::equal(again.begin() + kHeaderBytes, again.end(), bytes(body).begin()));
}

TEST(Messages, ATransformThatIsNoneIsRefused) {
  const auto of = [](std::vector<float> numbers) {
    Raw body;
    for (const float f : numbers) test::put_float(body, f);
    return read_transform(bytes(body));
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(of({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_FALSE(of({1.1f, 0, 0, 0, 1.1f, 0, 0, 0, 1.1f, 0, 0, 0}));
  EXPECT_FALSE(of({1, 0.2f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_FALSE(of({1, 0, 0, 0, 1, 0, 0, 0, -1, 0, 0, 0}));
  EXPECT_FALSE(of({nan, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_FALSE(of({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, nan, 0}));
  EXPECT_FALSE(of({1, 0, 0, 0, 1, 0, 0, 0, 1, 1e6f, 0, 0}));
  EXPECT_FALSE(of({1, 0, 0}));
}

TEST(Messages, WhatIsWrittenIsReadBack) {
  Grid grid;
  grid.size = {3, 4, 5};
  grid.spacing_mm = {0.8, 1.2, 3.0};
  grid.origin_mm = {-13, 7, 24};
  grid.direction =
      glm::dmat3(glm::dvec3(0.8, 0.6, 0), glm::dvec3(-0.6, 0.8, 0), glm::dvec3(0, 0, 1));
  std::vector<float> values(grid.count());
  for (size_t n = 0; n < values.size(); ++n) values[n] = 0.25f * float(n) - 3.0f;
  const Bytes message = write_image("Moved", 12.5, grid, values);
  const auto header =
      read_header(std::span<const std::byte, kHeaderBytes>(message.data(), kHeaderBytes));
  ASSERT_TRUE(header);
  EXPECT_EQ(header->type, "IMAGE");
  EXPECT_EQ(header->device, "Moved");
  EXPECT_DOUBLE_EQ(header->time_s, 12.5);
  const auto content = content_of(*header, std::span(message).subspan(kHeaderBytes));
  ASSERT_TRUE(content);
  const auto image = read_image(*content);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_TRUE(same_geometry(image->grid, grid));
  EXPECT_EQ(image->values, values);
}

TEST(Messages, VectorsAreWrittenAlongRightAnteriorSuperior) {
  Grid grid;
  grid.size = {2, 2, 2};
  const Bytes message =
      write_image("Motion", 1.0, grid, std::vector<glm::vec3>(8, glm::vec3(1.0F, 2.0F, 3.0F)));
  // float32, little endian, after the header and the image's own header.
  const std::byte* const values = message.data() + kHeaderBytes + 72;
  ASSERT_EQ(message.size(), kHeaderBytes + 72 + 8 * 3 * sizeof(float));
  float first[3];
  std::memcpy(first, values, sizeof first);
  EXPECT_EQ(first[0], -1.0F);
  EXPECT_EQ(first[1], -2.0F);
  EXPECT_EQ(first[2], 3.0F);
}

/// The force in a message is along R, A, S; palpate's is along L, P, S.
TEST(Messages, AForceIsWrittenAlongRightAnteriorSuperior) {
  const Bytes sent = write_force("palpate_force", 1.0, {1.0, 2.0, 3.0});
  constexpr size_t kHeader = 58, kBeforeNumbers = 10;
  ASSERT_EQ(sent.size(), kHeader + kBeforeNumbers + 3 * sizeof(double));
  const double right_anterior_superior[3] = {-1.0, -2.0, 3.0};
  for (size_t a = 0; a < 3; ++a) {
    uint64_t bits = 0;
    for (size_t k = 0; k < 8; ++k)
      bits = bits << 8 | uint64_t(sent[kHeader + kBeforeNumbers + 8 * a + k]);
    EXPECT_EQ(std::bit_cast<double>(bits), right_anterior_superior[a]) << a;
  }
}

TEST(Messages, MutatedMessagesAreReadOrRefused) {
  std::mt19937 random(20261123);
  WireImage wire;
  wire.scalar_type = 4;
  wire.samples = Raw(48, 7);
  const Raw plain = test::wire_message({}, wire.body());
  WireHeader second;
  second.version = 2;
  const Raw with_meta =
      test::wire_message(second, test::extended(wire.body(), Raw(10, 1), Raw(20, 2)));
  int read = 0, refused = 0;
  for (int n = 0; n < 20'000; ++n) {
    Raw raw = n % 2 ? plain : with_meta;
    for (unsigned changes = random() % 4; changes > 0; --changes)
      raw[random() % raw.size()] = uint8_t(random());
    if (random() % 4 == 0) raw.resize(kHeaderBytes + random() % (raw.size() - kHeaderBytes + 1));
    auto header =
        read_header(std::span<const std::byte, kHeaderBytes>(bytes(raw).data(), kHeaderBytes));
    if (!header) {
      ++refused;
      continue;
    }
    const auto body = bytes(raw).subspan(kHeaderBytes);
    // So that the code after this check is reached.
    header->crc = crc64(body);
    const auto content = content_of(*header, body);
    const auto image = content ? read_image(*content) : Result<ImageMessage>(content.error());
    if (content) (void)read_transform(*content);
    if (image) {
      EXPECT_EQ(image->values.size(), size_t(image->size.x) * image->size.y * image->size.z);
      ++read;
    } else {
      EXPECT_FALSE(image.error().message.empty());
      ++refused;
    }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace palpate::openigtlink
