#include "tests/app/headset_play.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "tests/app/scenes.h"

namespace palpate::app {

using files::TemporaryFolder;

std::string still_heart(const TemporaryFolder& folder) {
  // From a file, because the program computes all frames and their motion of its own shell.
  written(shell_phantom(64, 1).frames[0], folder / "still.mha");
  const std::string file = folder / "still.json";
  std::ofstream(file) << R"({"volumes": [{"name": "heart", "files": "still.mha"}],
    "modes": [{"name": "wall", "kind": "surface", "volume": "heart",
               "strength": {"window": {"level": 625, "width": 150, "full": 5}}}]})";
  return file;
}

std::vector<std::string> feel(const std::string& what, const std::vector<std::string>& more) {
  // A busy machine must not trigger the watchdog in a test of something else.
  std::vector<std::string> all = {"feel", what,          "--watchdog",
                                  "1000", "--black-box", std::filesystem::temp_directory_path()};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

bool says(Program& program, const std::string& text, size_t from) {
  const auto said = [&] { return program.said().find(text, from) != std::string::npos; };
  return wait_until([&] { return program.ended() || said(); }) && said();
}

bool feels(Program& program, double force_n) {
  static const std::regex force("([0-9.]+) N  phase");
  const auto told = [&] {
    const std::string said = program.said();
    return std::any_of(std::sregex_iterator(said.begin(), said.end(), force),
                       std::sregex_iterator(),
                       [&](const std::smatch& found) { return std::stod(found[1]) > force_n; });
  };
  return wait_until([&] { return program.ended() || told(); }) && told();
}

static glm::dvec3 place(const Table& ticks, size_t row, const char* what) {
  const std::string name = what;
  return {ticks.number(row, name + "_x_m"), ticks.number(row, name + "_y_m"),
          ticks.number(row, name + "_z_m")};
}

static Way found_way(const std::string& scene, const TemporaryFolder& folder) {
  const Outcome pressed = run_computed(
      feel(scene, {"--headset", "off", "--device", "simulated", "--csv", folder / "way.csv"}));
  EXPECT_EQ(pressed.exit_code, 0) << pressed.err;
  const Table ticks(folder / "way.csv");
  Way way;
  for (size_t row = 0; row < ticks.size(); ++row) {
    if (row == 0) way.start_m = place(ticks, row, "probe");
    if (ticks.text(row, "contact") != "1") continue;
    way.surface_m = place(ticks, row, "probe");
    return way;
  }
  ADD_FAILURE() << "the hand met no surface";
  return way;
}

Way way_to_surface(const std::string& scene, const TemporaryFolder& folder) {
  static const Way way = found_way(scene, folder);
  return way;
}

std::string path_file(const TemporaryFolder& folder,
                      const std::vector<std::pair<double, glm::dvec3>>& points) {
  const std::string file = folder / "path.csv";
  std::ofstream stream(file);
  for (const auto& [t, x] : points) stream << fmt::format("{},{},{},{}\n", t, x.x, x.y, x.z);
  return file;
}

std::string text_of(glm::dvec3 x) {
  return fmt::format("{} {} {}", x.x, x.y, x.z);
}

void expect_no_jump(const Table& ticks) {
  constexpr double kSlew_n_per_s = 2000.0, kDigits_n = 2e-5;
  for (size_t row = 1; row < ticks.size(); ++row) {
    const double dt_s = std::min(ticks.number(row, "dt_s"), 0.002);
    glm::dvec3 step(0.0);
    for (int a = 0; a < 3; ++a) {
      const std::string name = fmt::format("force_{}_n", "xyz"[a]);
      step[a] = ticks.number(row, name) - ticks.number(row - 1, name);
    }
    ASSERT_LE(glm::length(step), kSlew_n_per_s * std::max(dt_s, 0.001) + kDigits_n)
        << "row " << row;
  }
}

std::vector<std::pair<double, glm::dvec3>> presses(const Way& way) {
  std::vector<std::pair<double, glm::dvec3>> points;
  const glm::dvec3 deep = way.surface_m + 0.012 * way.in();
  for (int k = 0; k < 100; ++k) {
    const double t = 4.0 * k;
    points.insert(points.end(),
                  {{t, way.start_m}, {t + 1.5, way.start_m}, {t + 2.0, deep}, {t + 3.5, deep}});
  }
  return points;
}

}  // namespace palpate::app
