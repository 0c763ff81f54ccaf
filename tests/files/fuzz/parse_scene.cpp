#include <cmath>

#include "integration/files/scene/scene_file.h"
#include "module/scene/drive.h"
#include "tests/files/fuzz/parse_bytes.h"
#include "tests/support/require.h"

namespace palpate::files::fuzz {
namespace {

bool is_pose(const Transform& t) {
  const double length = glm::length(t.rotation);
  bool good = std::abs(length - 1.0) < 1e-9;
  for (int a = 0; a < 3; ++a)
    good = good && std::isfinite(t.translation_m[a]) && t.scale[a] >= 1e-4 && t.scale[a] <= 1e4;
  return good;
}

bool is_strength(const TransferFunction& f) {
  for (const double out : f.out())
    if (!(out >= 0.0 && std::isfinite(out))) return false;
  return std::isfinite(f(0.0)) && std::isfinite(f(1e308)) && std::isfinite(f(-1e308));
}

}  // namespace

void parse_scene_file(std::string_view bytes) {
  const auto scene = parse_scene("folder/fuzz.json", bytes);
  if (!scene) {
    require(scene.error().message.size() > 10, "an error is a sentence");
    require(scene.error().message.find(": ") != std::string::npos, "an error says what to do");
    return;
  }
  require(!scene->volumes.empty() && !scene->modes.empty(), "there is something to feel");
  require(scene->stiffness_n_per_m > 0.0 && std::isfinite(scene->stiffness_n_per_m),
          "the stiffness is positive");
  require(scene->max_force_n > 0.0, "the force is positive");
  require(is_pose(scene->world_from_device), "the device has a place");
  for (const VolumeSpec& v : scene->volumes) {
    require(!v.name.empty(), "volumes have names");
    require(v.source.empty() != v.files.empty(), "volumes have data");
    require(is_pose(v.transform), "volumes have a place");
    require(std::isfinite(v.rate) && v.frames_per_second >= 0.0, "rates are finite");
    require(glm::length(v.drive.axis) > 0.0, "axes have a direction");
    require(bool(check(v.drive, v.transform)), "drives can be followed");
    for (const double time_s : {0.0, 0.37, 1e5})
      require(v.drive.kind != DriveSpec::Kind::kKeys ||
                  bool(check(driven(v.drive, v.transform, time_s))),
              "keys lead to places");
    require((v.source == "charges") == !v.charges.empty(), "charges have charges");
    require(v.cycle_s >= 0.0 && std::isfinite(v.cycle_s), "cycles are finite");
  }
  for (const ModeSpec& m : scene->modes) {
    bool found = false;
    for (const VolumeSpec& v : scene->volumes) found = found || v.name == m.volume;
    require(found, "modes name volumes that exist");
    require(is_strength(m.strength) && is_strength(m.friction), "strengths are not below 0");
  }
}

}  // namespace palpate::files::fuzz
