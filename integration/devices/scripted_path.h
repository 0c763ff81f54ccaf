#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::devices {

/// Where a hand means to be over time, from points. Before the first point it waits there, after
/// the last one too. Space: the device's, m.
class ScriptedPath {
 public:
  struct PathPoint {
    double time_s = 0.0;
    glm::dvec3 position_m{0.0};
    uint32_t buttons = 0;  ///< held from this point to the next; bit k: button k
  };
  enum class Between : uint8_t {
    kLinear,  ///< even speed between points
    /// continuous velocity; each coordinate stays between its two points (Fritsch and Carlson 1980)
    kSmooth,
  };

  /// A hand that stays at the origin.
  ScriptedPath() = default;
  /// Times must rise.
  explicit ScriptedPath(std::vector<PathPoint> points, Between between = Between::kSmooth);

  /// Real-time safe, any thread.
  glm::dvec3 position_m(double time_s) const noexcept;
  uint32_t buttons(double time_s) const noexcept;

  double duration_s() const;
  const std::vector<PathPoint>& points() const { return points_; }

 private:
  size_t piece_of(double time_s) const noexcept;

  std::vector<PathPoint> points_;
  std::vector<glm::dvec3> rates_;  ///< velocity at each point; empty: linear
};

/// Reads a path: one point per line, "t_s,x_m,y_m,z_m" or "t_s,x_m,y_m,z_m,buttons", rising times,
/// an optional first line of names, comments after #. kBadInput with a sentence that names the line
/// otherwise. Any thread.
Result<ScriptedPath> read_path(const std::filesystem::path& file,
                               ScriptedPath::Between between = ScriptedPath::Between::kSmooth);
/// The same from text; `file` is only for messages.
Result<ScriptedPath> parse_path(const std::filesystem::path& file, std::string_view text,
                                ScriptedPath::Between between = ScriptedPath::Between::kSmooth);

}  // namespace palpate::devices
