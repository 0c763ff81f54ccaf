#include "tests/x3d/fuzz/parse_x3d.h"

#include <cmath>

#include "integration/x3d/x3d_file.h"
#include "module/scene/drive.h"
#include "tests/support/require.h"

namespace palpate::x3d::fuzz {
namespace {

bool is_strength(const TransferFunction& f) {
  for (const double out : f.out())
    if (!(out >= 0.0 && std::isfinite(out))) return false;
  return std::isfinite(f(0.0)) && std::isfinite(f(1e308)) && std::isfinite(f(-1e308));
}

}  // namespace

void parse_x3d_file(std::string_view bytes) {
  const auto scene = parse_x3d("folder/fuzz.x3d", bytes);
  if (!scene) {
    require(scene.error().message.size() > 10, "an error is a sentence");
    require(scene.error().message.find(": ") != std::string::npos, "an error says what to do");
    return;
  }
  const SceneSpec& spec = scene->spec;
  require(!spec.volumes.empty(), "there is a volume");
  require(spec.stiffness_n_per_m > 0.0 && std::isfinite(spec.stiffness_n_per_m),
          "the stiffness is positive");
  require(spec.max_force_n > 0.0 && std::isfinite(spec.max_force_n), "the force is positive");
  require(bool(check(spec.world_from_device)), "the device has a place");
  for (const VolumeSpec& v : spec.volumes) {
    require(!v.name.empty(), "volumes have names");
    require(v.source.empty() != v.files.empty(), "volumes have data");
    require(bool(check(v.transform)) && bool(check(v.drive, v.transform)), "volumes have a place");
    for (const double time_s : {0.0, 0.37, 1e5})
      require(bool(check(driven(v.drive, v.transform, time_s))), "volumes move to places");
    Look look;
    look.points = v.appearance.points;
    require(bool(check(look)), "looks can be drawn");
    require(v.cycle_s >= 0.0 && std::isfinite(v.cycle_s), "cycles are finite");
  }
  for (const ModeSpec& m : spec.modes) {
    bool found = false;
    for (const VolumeSpec& v : spec.volumes) found = found || v.name == m.volume;
    require(found, "modes name volumes that exist");
    require(is_strength(m.strength) && is_strength(m.friction), "strengths are not below 0");
  }
  const auto text = x3d_text(spec, "folder/again.x3d");
  require(bool(text), "what was read can be written");
  const auto again = parse_x3d("folder/again.x3d", text->text);
  require(bool(again), "what was written can be read");
  require(again->spec.volumes.size() == spec.volumes.size() &&
              again->spec.modes.size() == spec.modes.size(),
          "what was written is the same scene");
}

}  // namespace palpate::x3d::fuzz
