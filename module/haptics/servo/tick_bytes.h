#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "module/haptics/servo/tick_fields.h"

namespace palpate {

/// Appends fields to bytes as the recording has them.
struct FieldEncoder {
  std::string& bytes;

  template <class Whole>
  void whole(Whole value) {
    for (size_t k = 0; k < sizeof value; ++k)
      bytes.push_back(char(std::make_unsigned_t<Whole>(value) >> (8 * k) & 0xff));
  }
  void operator()(const char*, const char*, double v) { whole(std::bit_cast<uint64_t>(v)); }
  void operator()(const char*, const char*, bool v) { whole(uint8_t(v)); }
  void operator()(const char*, const char*, const glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) (*this)("", "", v[axis]);
  }
  void operator()(const char*, const char*, const glm::dquat& v) {
    for (double part : {v.w, v.x, v.y, v.z}) (*this)("", "", part);
  }
  template <class Value>
  requires std::is_integral_v<Value>
  void operator()(const char*, const char*, Value v) { whole(v); }
  template <class Value>
  requires std::is_enum_v<Value>
  void operator()(const char*, const char*, Value v) {
    static_assert(sizeof v == 1);
    whole(uint8_t(v));
  }
};

/// Takes fields from bytes. Beyond the end `good` becomes false and fields are zero. At a truth
/// value other than 0 and 1 `possible` becomes false.
struct FieldDecoder {
  std::string_view bytes;
  size_t at = 0;
  bool good = true, possible = true;

  template <class Whole>
  Whole whole() {
    using Bits = std::make_unsigned_t<Whole>;
    if (!good || bytes.size() - at < sizeof(Whole)) {
      good = false;
      return Whole{};
    }
    Bits value = 0;
    for (size_t k = 0; k < sizeof value; ++k)
      value = Bits(value | Bits(Bits(uint8_t(bytes[at + k])) << (8 * k)));
    at += sizeof value;
    return Whole(value);
  }
  void operator()(const char*, const char*, double& v) {
    v = std::bit_cast<double>(whole<uint64_t>());
  }
  void operator()(const char*, const char*, bool& v) {
    const auto byte = whole<uint8_t>();
    if (byte > 1) possible = false;
    v = byte == 1;
  }
  void operator()(const char*, const char*, glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) (*this)("", "", v[axis]);
  }
  void operator()(const char*, const char*, glm::dquat& v) {
    for (double* part : {&v.w, &v.x, &v.y, &v.z}) (*this)("", "", *part);
  }
  template <class Value>
  requires std::is_integral_v<Value>
  void operator()(const char*, const char*, Value& v) { v = whole<Value>(); }
  template <class Value>
  requires std::is_enum_v<Value>
  void operator()(const char*, const char*, Value& v) { v = Value(whole<uint8_t>()); }
};

inline constexpr std::string_view kRecordingMagic{"palpate-ticks\r\n\x1a", 16};
inline constexpr uint32_t kRecordingVersion = 3;
inline constexpr uint32_t kOldestRecording = 1;  ///< without how the grip is held
inline constexpr size_t kLongestScene = 1 << 20;

/// FNV-1a, 64 bits, continued: notices damage, not malice.
inline constexpr uint64_t kEmptyHash = 0xcbf29ce484222325;
inline uint64_t hash_on(uint64_t hash, std::string_view bytes) {
  for (char byte : bytes) hash = (hash ^ uint8_t(byte)) * 0x100000001b3;
  return hash;
}

inline void encode_tick(const TickInput& input, const TickOutput& output, std::string& bytes) {
  FieldEncoder encoder{bytes};
  bytes.push_back('T');
  encoder.whole(uint8_t(input.pose_count));
  encoder.whole(uint8_t(input.event_count));
  visit_input(input, encoder);
  for (int k = 0; k < input.pose_count; ++k) visit_pose(input.poses[size_t(k)], encoder);
  for (int k = 0; k < input.event_count; ++k) visit_event(input.events[size_t(k)], encoder);
  visit_grip(input.reading.grip, encoder);
  visit_output(output, encoder);
  visit_torque(output, encoder);
}

/// Decodes what follows the 'T' in a recording of this version. False if it is cut off or has
/// impossible values.
inline bool decode_tick(FieldDecoder& decoder, uint32_t version, TickInput& input,
                        TickOutput& output) {
  input = TickInput{};
  output = TickOutput{};
  input.pose_count = decoder.whole<uint8_t>();
  input.event_count = decoder.whole<uint8_t>();
  if (input.pose_count > int(input.poses.size()) || input.event_count > int(input.events.size()))
    return false;
  visit_input(input, decoder);
  for (int k = 0; k < input.pose_count; ++k) visit_pose(input.poses[size_t(k)], decoder);
  for (int k = 0; k < input.event_count; ++k) visit_event(input.events[size_t(k)], decoder);
  if (version >= 2) visit_grip(input.reading.grip, decoder);
  visit_output(output, decoder);
  if (version >= 3) visit_torque(output, decoder);
  return decoder.good && decoder.possible;
}

}  // namespace palpate
