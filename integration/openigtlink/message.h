#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// OpenIGTLink's messages, versions 1 to 3, as bytes. Everything is checked before it is believed,
/// and before memory is taken for it. Numbers are big-endian on the wire; places are RAS, mm, there
/// and LPS, mm, here. Any thread.
namespace palpate::openigtlink {

using Bytes = std::vector<std::byte>;

constexpr size_t kHeaderBytes = 58;
constexpr int kMostSamplesPerAxis = 1024;
/// The largest body that is taken in: an image of float64 with 512 x 512 x 512 samples and its
/// text.
constexpr uint64_t kLargestBody = (uint64_t(1) << 30) + (1 << 20);

/// The first 58 bytes.
struct Header {
  int version = 1;      ///< 1; 2 for versions 2 and 3, which have an extended header
  std::string type;     ///< IMAGE, TRANSFORM, STATUS, ...
  std::string device;   ///< who it is from, as the sender named it
  double time_s = 0.0;  ///< the sender's clock; 0: it gave none
  uint64_t body_bytes = 0;
  uint64_t crc = 0;  ///< of the body, ECMA-182
};

/// kBadInput: a version that is not 1 to 3, a type without letters, a body above kLargestBody, or
/// one that can not be of its type. After that nobody knows where the next message begins.
Result<Header> read_header(std::span<const std::byte, kHeaderBytes> bytes);

/// ECMA-182, as OpenIGTLink has it.
uint64_t crc64(std::span<const std::byte> bytes);

/// The body without the extended header and the metadata of version 2 and 3. kBadInput: the sum
/// does not match, or the sizes in it do not fit. accepts_no_crc: the sum 0 means that there is
/// none.
Result<std::span<const std::byte>> content_of(const Header& header, std::span<const std::byte> body,
                                              bool accepts_no_crc = false);

/// An IMAGE, or a part of one.
struct ImageMessage {
  Grid grid;                     ///< of the whole image, LPS; left-handed ones are turned right
  bool j_reversed = false;       ///< its j axis was the other way round on the wire
  bool is_ras_assumed = false;   ///< the sender left the coordinate system open (0)
  glm::ivec3 first{0}, size{0};  ///< the part that came, in the sender's order of samples
  std::vector<float> values;     ///< of the part, shape (size.z, size.y, size.x)
  bool is_whole() const { return size == grid.size; }
};

/// The size of an IMAGE that is no volume: one sample along an axis, as a picture of 2D ultrasound
/// has it. Nothing: it is a volume, or a part of one, or no image at all, as read_image() says.
std::optional<glm::ivec3> flat_size(std::span<const std::byte> content);

/// kBadInput: sizes that do not fit each other or the body, more than one value per sample, a
/// scalar type or an endianness that does not exist, a matrix that is not finite or is no grid.
/// Values that are not finite are refused too.
Result<ImageMessage> read_image(std::span<const std::byte> content);

/// A TRANSFORM: a rotation and a translation in LPS, mm.
struct Rigid {
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation_mm{0.0};
};
/// kBadInput: not 48 bytes, not finite, farther than 10 m, or with scale, shear or a mirror.
Result<Rigid> read_transform(std::span<const std::byte> content);

// What palpate sends: messages of version 1, which every receiver takes.

/// An IMAGE of float32, little-endian: a number per sample of the grid, or a vector (LPS; RAS on
/// the wire).
Bytes write_image(const std::string& device, double time_s, const Grid& grid,
                  std::span<const float> values);
Bytes write_image(const std::string& device, double time_s, const Grid& grid,
                  std::span<const glm::vec3> vectors);
Bytes write_transform(const std::string& device, double time_s, const Rigid& rigid);
/// SENSOR: three numbers of float64 with the unit N (LPS; RAS on the wire).
Bytes write_force(const std::string& device, double time_s, glm::dvec3 force_n);
/// STATUS: `code` 1 is OK, 13 is "not ready"; text at most 200 bytes.
Bytes write_status(const std::string& device, double time_s, int code, const std::string& text);

}  // namespace palpate::openigtlink
