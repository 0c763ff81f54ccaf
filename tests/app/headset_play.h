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

/// Functions that the tests of `palpate feel` in a simulated headset share.

inline constexpr const char* kSelect = "input /user/hand/right/input/select/click ";
inline constexpr const char* kMenu = "input /user/hand/left/input/menu/click ";

/// A scene file: one frame of the shell of `palpate feel shell`, at half its resolution.
std::string still_heart(const files::TemporaryFolder& folder);
/// The command line of `palpate feel`.
std::vector<std::string> feel(const std::string& what, const std::vector<std::string>& more);
/// Waits until the program has printed `text` after `from`. False if it ends before.
bool says(Program& program, const std::string& text, size_t from = 0);
/// Waits until one of the lines that the program prints in each second tells more than this force.
/// False if it ends before.
bool feels(Program& program, double force_n);

/// The place where the simulated hand waits in front of a scene, and where it meets the surface.
struct Way {
  glm::dvec3 start_m{0.0}, surface_m{0.0};
  glm::dvec3 in() const { return glm::normalize(surface_m - start_m); }
};
/// The way to the still heart's surface; found once.
Way way_to_surface(const std::string& scene, const files::TemporaryFolder& folder);
/// A file with a path of the simulated hand through these points at these times, s.
std::string path_file(const files::TemporaryFolder& folder,
                      const std::vector<std::pair<double, glm::dvec3>>& points);
/// A hand that presses for two seconds and is free for two, repeatedly.
std::vector<std::pair<double, glm::dvec3>> presses(const Way& way);
std::string text_of(glm::dvec3 x);
/// Checks that no step of the force is larger than the guards' slew allows in the time between two
/// ticks (at most 2 ms count), plus the rounding of the CSV.
void expect_no_jump(const Table& ticks);

class InAHeadset : public ::testing::Test {
 protected:
  void SetUp() override { NEEDS_DEVICE(); }
  files::TemporaryFolder folder;
};

}  // namespace palpate::app
