#include "integration/loading/c_modes.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <exception>

namespace palpate::loading {
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

/// A site with its functions but without numbers.
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

class CMode final : public ForeignMode {
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
    const std::string thrown = attempted([&] { mode_ = kind_.make(&said_, why_.data(), kMost); });
    if (!thrown.empty()) fmt::format_to_n(why_.data(), kMost - 1, "its make() threw: {}", thrown);
    why_.back() = '\0';
  }
  ~CMode() override {
    // A failure to free it can not be reported.
    if (mode_ && kind_.destroy) attempted([&] { kind_.destroy(mode_); });
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
    if (has_failed_.load(std::memory_order_relaxed)) return;
    // Code in C++ may throw. What it has placed before counts for this frame. In later frames it
    // places nothing, and the force follows slowly, as at any surface that ends.
    try {
      kind_.place(mode_, &site);
    } catch (const std::exception& error) {
      fail(error.what());
    } catch (...) {
      fail("an exception without a message");
    }
  }
  bool wants_probe() const override { return kind_.wants_hand != 0; }
  const char* failure() const noexcept override {
    return is_told_.load(std::memory_order_acquire) ? failure_.data() : "";
  }

 private:
  static constexpr size_t kMost = 512;

  /// Runs a function of the library: returns the message of its exception, or "".
  template <class Call>
  static std::string attempted(const Call& call) {
    try {
      call();
      return {};
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "an exception without a message";
    }
  }

  /// If several threads place, the first failure is kept.
  void fail(const char* thrown) const noexcept {
    if (has_failed_.exchange(true)) return;
    constexpr std::string_view kBegin = "A mode threw an exception, and is left out from now on: ";
    size_t length = kBegin.copy(failure_.data(), kMost - 1);
    length += std::string_view(thrown).copy(failure_.data() + length, kMost - 1 - length);
    failure_[length] = '\0';
    is_told_.store(true, std::memory_order_release);
  }

  const PalModeKind& kind_;
  ModeSpec spec_;
  PalModeSpec said_{};
  void* mode_ = nullptr;
  std::array<char, kMost> why_{};
  mutable std::atomic<bool> has_failed_{false}, is_told_{false};
  mutable std::array<char, kMost> failure_{};
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

}  // namespace palpate::loading
