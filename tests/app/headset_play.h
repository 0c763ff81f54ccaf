#pragma once

#include <gtest/gtest.h>

#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/app/made_headset.h"
#include "tests/app/program.h"
#include "tests/app/ticks.h"

namespace palpate::app {

/// `palpate feel` in a headset of the tests' own: what its tests share.

inline constexpr const char* kSelect = "input /user/hand/right/input/select/click ";
inline constexpr const char* kMenu = "input /user/hand/left/input/menu/click ";

/// The beating shell of `palpate feel shell`, held still: a scene file.
std::string still_heart(const files::TemporaryFolder& folder);
/// The command line of `palpate feel`.
std::vector<std::string> feel(const std::string& what, const std::vector<std::string>& more);
/// Waits until it does; false if it ends before.
bool says(Program& program, const std::string& text, size_t from = 0);

/// Where the simulated hand waits before a scene, and where it meets it.
struct Way {
  glm::dvec3 start_m{0.0}, surface_m{0.0};
  glm::dvec3 in() const { return glm::normalize(surface_m - start_m); }
};
/// Of the still heart; found once.
Way way_to_surface(const std::string& scene, const files::TemporaryFolder& folder);
/// A path of the simulated hand through these points at these seconds.
std::string path_file(const files::TemporaryFolder& folder,
                      const std::vector<std::pair<double, glm::dvec3>>& points);
/// A hand that presses for two seconds and is free for two, again and again.
std::vector<std::pair<double, glm::dvec3>> presses(const Way& way);
std::string text_of(glm::dvec3 x);
/// No step of the force larger than the guards' slew allows in the time between two ticks (at most
/// 2 ms count), and the CSV's last digits.
void expect_no_jump(const Table& ticks);

class InAHeadset : public ::testing::Test {
 protected:
  void SetUp() override { NEEDS_DEVICE(); }
  files::TemporaryFolder folder;
};

}  // namespace palpate::app
