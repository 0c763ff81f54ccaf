#include "integration/scenes/c_modes.h"

#include <array>

namespace palpate::scenes {
namespace {

glm::dvec3 vec(const double v[3]) {
  return {v[0], v[1], v[2]};
}

void put(glm::dvec3 v, double to[3]) {
  for (int a = 0; a < 3; ++a) to[a] = v[a];
}

const LocalData& data_of(const PalModeSite* site) {
  return *static_cast<const LocalData*>(site->data);
}

PrimitiveSink& sink_of(const PalModeSite* site) {
  return *static_cast<PrimitiveSink*>(site->sink);
}

/// Everything of a site but its numbers.
constexpr PalModeSite functions() {
  PalModeSite site{};
  site.scalar = [](const PalModeSite* of) { return data_of(of).scalar(); };
  site.scalar_gradient = [](const PalModeSite* of, double per_m[3]) {
    put(data_of(of).scalar_gradient(), per_m);
  };
  site.vector = [](const PalModeSite* of, double vector[3]) { put(data_of(of).vector(), vector); };
  site.surface = [](const PalModeSite* of, const double position_m[3], const double outward[3],
                    double strength_n, double friction) {
    sink_of(of).surface(vec(position_m), vec(outward), strength_n, friction);
  };
  site.line = [](const PalModeSite* of, const double position_m[3], const double tangent[3],
                 double strength_n) {
    sink_of(of).line(vec(position_m), vec(tangent), strength_n);
  };
  site.point = [](const PalModeSite* of, const double position_m[3], double strength_n) {
    sink_of(of).point(vec(position_m), strength_n);
  };
  site.force = [](const PalModeSite* of, const double tangent[3], double strength_n) {
    sink_of(of).force(vec(tangent), strength_n);
  };
  return site;
}

class CMode final : public Mode {
 public:
  CMode(const PalModeKind& kind, const ModeSpec& spec) : kind_(kind), spec_(spec) {
    said_.name = spec_.name.c_str();
    said_.gain = spec_.gain;
    said_.range_m = spec_.range_m;
    put(spec_.point_m, said_.point_m);
    said_.is_two_sided = spec_.two_sided;
    said_.is_leaving = spec_.leaving;
    said_.highest_strength_n = spec_.strength.highest();
    said_.scene = &spec_;
    said_.strength_n = [](const PalModeSpec* said, double value) {
      return static_cast<const ModeSpec*>(said->scene)->strength(value);
    };
    said_.friction = [](const PalModeSpec* said, double value) {
      return static_cast<const ModeSpec*>(said->scene)->friction(value);
    };
    mode_ = kind_.make(&said_, why_.data(), why_.size());
    why_.back() = '\0';
  }
  ~CMode() override {
    if (mode_ && kind_.destroy) kind_.destroy(mode_);
  }
  CMode(const CMode&) = delete;
  CMode& operator=(const CMode&) = delete;

  bool is_made() const { return mode_ != nullptr; }
  std::string why_not() const { return why_.data(); }

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    static constexpr PalModeSite kFunctions = functions();
    PalModeSite site = kFunctions;
    put(at.proxy, site.proxy_m);
    put(at.probe, site.hand_m);
    site.dt_s = at.dt_s;
    site.data = &at.data;
    site.sink = &out;
    kind_.place(mode_, &site);
  }
  bool wants_probe() const override { return kind_.wants_hand != 0; }

 private:
  const PalModeKind& kind_;
  ModeSpec spec_;
  PalModeSpec said_{};
  void* mode_ = nullptr;
  std::array<char, 512> why_{};
};

}  // namespace

Status add_c_mode(const PalModeKind& kind, ModeKinds& kinds) {
  if (!kind.name || !*kind.name || !kind.make || !kind.place)
    return Error{ErrorKind::kBadInput, "a kind of mode needs a name, make and place"};
  kinds.add(kind.name, [&kind](const ModeSpec& spec) -> Result<std::shared_ptr<const Mode>> {
    auto mode = std::make_shared<const CMode>(kind, spec);
    if (mode->is_made()) return std::shared_ptr<const Mode>(std::move(mode));
    return Error{ErrorKind::kBadInput,
                 "Mode \"" + spec.name + "\" can not be made: " + mode->why_not()};
  });
  return Nothing{};
}

}  // namespace palpate::scenes
