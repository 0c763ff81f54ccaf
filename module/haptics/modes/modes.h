#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/mode.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// The kinds of mode a scene may name, and how each is made from its part of the scene. Starts with
/// those of the paper:
/// - surface: a one- or two-sided surface across the gradient, with Coulomb friction: equation (12)
/// - follow: a line along a vector: guides along field lines, (13)
/// - front: a surface across a vector
/// - vortex: a line along a vector's curl: guides along the cores of vortices
/// - gradient-force: f = C grad L: equation (2)
/// - vector-force: f = C L: equation (3)
/// - attractor: a point that pulls
/// - tissue: a force against going deeper into higher values, without a surface
/// - viscosity: slows the hand down against the material
/// Add your own before a scene is made; not while one is. Not thread safe.
class ModeKinds {
 public:
  using Make = std::function<Result<std::shared_ptr<const Mode>>(const ModeSpec&)>;
  ModeKinds();
  void add(const std::string& kind, Make make) { kinds_[kind] = std::move(make); }
  /// All kinds that are known, in alphabetical order.
  std::vector<std::string> names() const;
  /// kBadInput for an unknown kind (naming the known ones) or a part of the scene the kind can not
  /// use.
  Result<std::shared_ptr<const Mode>> make(const ModeSpec& spec) const;
  /// Fills in what the kind reads where the scene leaves it open: a surface always uses the
  /// gradient, whatever `vector` says.
  static ModeSpec completed(ModeSpec spec);

 private:
  std::map<std::string, Make> kinds_;
};

/// What a program and a library of modes must have in common to work together: both compile it from
/// this header. `interface` counts the changes of what the library calls or is called with.
struct ModeLibraryStamp {
  uint32_t interface = 2;
  uint32_t spec_bytes = sizeof(ModeSpec);
  uint32_t point_bytes = sizeof(ModePoint);
  friend bool operator==(const ModeLibraryStamp&, const ModeLibraryStamp&) = default;
};

/// In one file of a library (.so) that `--modes` loads: `add` is a function that adds its kinds to
/// the ModeKinds& that it is given. Called once, before scenes are made.
#define PALPATE_MODES(add)                                                \
  extern "C" void palpate_modes_stamp(palpate::ModeLibraryStamp* stamp) { \
    *stamp = palpate::ModeLibraryStamp{};                                 \
  }                                                                       \
  extern "C" void palpate_add_modes(palpate::ModeKinds* kinds) {          \
    add(*kinds);                                                          \
  }

Result<std::shared_ptr<const Mode>> make_surface(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_follow(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_front(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_force(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_attractor(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_tissue(const ModeSpec& spec);
Result<std::shared_ptr<const Mode>> make_viscosity(const ModeSpec& spec);

}  // namespace palpate
