#include "tests/devices/fuzz/parse_path_bytes.h"

#include <algorithm>
#include <cmath>

#include "integration/devices/scripted_path.h"
#include "tests/support/require.h"

namespace palpate::devices::fuzz {
void parse_path_bytes(std::string_view bytes) {
  for (const auto between : {ScriptedPath::Between::kLinear, ScriptedPath::Between::kSmooth}) {
    const auto path = parse_path("fuzz.csv", bytes, between);
    if (!path) {
      require(path.error().message.find(": ") != std::string::npos, "an error says what to do");
      continue;
    }
    const auto& points = path->points();
    require(!points.empty(), "there is a point");
    for (size_t n = 0; n + 1 < points.size(); ++n) {
      const auto &a = points[n], &b = points[n + 1];
      require(b.time_s > a.time_s, "times rise");
      for (const double share : {0.0, 0.3, 0.5, 0.9, 1.0}) {
        const glm::dvec3 at = path->position_m(a.time_s + share * (b.time_s - a.time_s));
        for (int axis = 0; axis < 3; ++axis) {
          const auto [low, high] = std::minmax(a.position_m[axis], b.position_m[axis]);
          require(at[axis] >= low - 1e-9 && at[axis] <= high + 1e-9,
                  "a path stays between its points");
        }
      }
    }
    const glm::dvec3 end = path->position_m(path->duration_s() + 1.0);
    require(end == points.back().position_m, "a path waits at its end");
  }
}

}  // namespace palpate::devices::fuzz
