#pragma once

#include <cstring>
#include <random>

#include "module/haptics/servo/tick_fields.h"

namespace palpate::test {

/// Fills every field with random bits, so that some numbers are infinite or NaN.
struct RandomFields {
  std::mt19937_64& random;
  template <class Value>
  void operator()(const char*, const char*, Value& v) {
    if constexpr (std::is_same_v<Value, bool>) {
      v = (random() & 1) != 0;
    } else if constexpr (std::is_same_v<Value, glm::dvec3>) {
      for (int k = 0; k < 3; ++k) (*this)("", "", v[k]);
    } else if constexpr (std::is_same_v<Value, glm::dquat>) {
      for (int k = 0; k < 4; ++k) (*this)("", "", v[k]);
    } else {
      const uint64_t bits = random();
      std::memcpy(&v, &bits, sizeof v);
    }
  }
};

inline void random_tick(std::mt19937_64& random, TickInput& input, TickOutput& output) {
  input = TickInput{};
  output = TickOutput{};
  RandomFields fields{random};
  visit_input(input, fields);
  input.pose_count = int(random() % 5);
  input.event_count = int(random() % 5);
  for (int k = 0; k < input.pose_count; ++k) visit_pose(input.poses[size_t(k)], fields);
  for (int k = 0; k < input.event_count; ++k) visit_event(input.events[size_t(k)], fields);
  visit_grip(input.reading.grip, fields);
  visit_output(output, fields);
  visit_torque(output, fields);
}

}  // namespace palpate::test
