// The program in its window, on a screen of Xvfb, with a mouse that xdotool moves.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "tests/app/program.h"
#include "tests/desktop/virtual_display.h"

namespace palpate::app {
namespace {

using test::Screenshot;
using test::VirtualDisplay;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

/// The rows of a table of ticks: force (N) and probe (m).
struct Felt {
  double force_n = 0.0;
  double probe_m[3] = {};
};
std::vector<Felt> read_ticks(const std::filesystem::path& file) {
  std::vector<Felt> rows;
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::istringstream cells(line);
    std::vector<double> values;
    for (std::string cell; std::getline(cells, cell, ',') && values.size() < 11;)
      values.push_back(std::strtod(cell.c_str(), nullptr));
    if (values.size() < 11) continue;
    rows.push_back(
        {std::hypot(values[2], values[3], values[4]), {values[8], values[9], values[10]}});
  }
  return rows;
}

/// How much of the middle of a window of 1120 x 760 is redder than the blue-grey background.
double share_of_flesh(const Screenshot& shot) {
  int red = 0, all = 0;
  for (int y = 230; y < 530; y += 5)
    for (int x = 410; x < 710; x += 5, ++all) {
      const uint32_t pixel = shot.at(x, y);
      red += int(pixel >> 16 & 255) > int(pixel & 255) + 25;
    }
  return double(red) / all;
}

/// Waits as long as a busy machine may need.
template <class Done>
bool wait_until(Done done) {
  for (int k = 0; k < 2400; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(50ms);
  }
  return false;
}

TEST(Desktop, LetsAMousePressTheBeatingHeart) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const files::TemporaryFolder folder;
  const auto csv = folder / "ticks.csv";
  Program program(
      {"feel", "heart", "--headset", "none", "--device", "mouse", "--csv", csv.string()});
  ASSERT_TRUE(wait_until([&] { return share_of_flesh(display->screenshot()) > 0.1; }))
      << "no heart is to be seen";
  // The force is let in over two seconds, in which the hand must be free.
  ASSERT_TRUE(display->act("mousemove 560 380 sleep 3"));
  ASSERT_TRUE(display->act("click --repeat 40 --delay 50 4 sleep 1"));
  ASSERT_TRUE(display->act("key Escape"));
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("mouse, as asked"));
  const std::vector<Felt> ticks = read_ticks(csv);
  ASSERT_GT(ticks.size(), 1000u);
  double most_n = 0.0;
  for (const Felt& tick : ticks) most_n = std::max(most_n, tick.force_n);
  EXPECT_GT(most_n, 0.3) << "the heart's wall holds the probe";
  // The eye stands at the front (+z): what the wheel took away from it went to -z.
  EXPECT_LT(ticks.back().probe_m[2], ticks.front().probe_m[2] - 0.01);
}

TEST(Desktop, SaysThatThereIsNoDisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const Outcome outcome = run({"feel", "heart", "--headset", "none"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("No window could be opened"));
}

TEST(Desktop, RefusesAMouseWhereThereIsNoWindow) {
  const Outcome outcome = run({"feel", "heart", "--device", "mouse"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--headset none"));
}

}  // namespace
}  // namespace palpate::app
