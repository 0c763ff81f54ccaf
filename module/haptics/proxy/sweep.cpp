#include "module/haptics/proxy/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "module/haptics/proxy/balance.h"
#include "module/haptics/proxy/placed_pair.h"

namespace palpate {
namespace {

constexpr int kMostPieces = 48;
// Samples of the data, one per mode and place: enough for a hand of 1 m/s, which moves 1 mm in a
// frame. Where the proxy has further to go, because a surface gave way, it takes several frames, so
// that no frame takes many times as long as another.
constexpr int kMostSweepSamples = 96;
constexpr int kMostHalvings = 24;
constexpr int kMostCarriers = kMostModes;
// Shorter moves are not corrected: how far they bend is less than an encoder resolves.
constexpr double kShort_m = 0.5e-6;
constexpr double kContact_m = 0.2e-6;
// a plane is in the way if its normal has more than this against the way
constexpr double kAgainst = 1e-9;
// A way that rises from a plane by no more than this, per length, leads along it.
constexpr double kAlong = 1e-3;

// Where a surface bends, pieces are halved, down to a sixteenth of a stride.
constexpr double kShortestPiece = 1.0 / 16.0;
// Forces that balance before this share of a piece end it there.
constexpr double kGivesWay = 0.8;
// The correction that puts a slide back on its iso-surface may be at most this share of its length;
// where it would be more, the data are too rough for it.
constexpr double kMostBack = 0.25;
// How deep below the value it was met with a surface may be left alone, and how fast it may take
// the proxy along by its values alone, per frame; in strides.
constexpr double kSunk = 0.2, kMostFollowed = 0.03;

// Where a scene is exchanged no time passes: a damper then holds the proxy.
constexpr double kShortestDrag_s = 1e-6;

class Way {
 public:
  Way(HapticRun& run, PointRun& point, glm::dvec3 probe, double stiffness, double dt_s)
      : run_(run), point_(point), hand_(probe), probe_(probe), stiffness_(stiffness), dt_s_(dt_s) {}

  Sweep go() noexcept {
    Sweep result;
    Placed *here = &run_.scratch[0], *there = &run_.scratch[1], *between = &run_.scratch[2];

    // What holds the proxy where it is, and what the time since the last frame did to it.
    for (size_t c = 0; c < point_.carriers.size(); ++c)
      starts_[c] = point_.carriers[c].carrier->mark();
    place(*here);
    result.drag_n_s_per_m = here->drag_n_s_per_m;
    if (here->drag_n_s_per_m > 0.0) join_drag(*here);
    follow_surfaces(*here);
    while (result.pieces < kMostPieces && samples_ < kMostSweepSamples) {
      // 1. Where the primitives at this place balance, and the way there.
      Balance balance = solve(*here, result);
      measure(balance.proxy);
      if (length_ <= kShort_m) {
        advance(1.0, balance.proxy);
        result.proxy = balance.proxy;
        return result;
      }

      // 2. A piece of the way, no longer than the planes can be trusted.
      ++result.pieces;
      mark();
      double share = std::min(1.0, strides_per_piece_ / strides_);
      advance(share, balance.proxy);
      place(*there);

      // 3. A surface was met on the piece: on from where it begins to hold.
      if (const uint32_t met = against(*there) & ~stood_on(*here)) {
        find_contact(met, share, balance.proxy, *there);
        keep_iso_values(*there, met);
        std::swap(here, there);
        continue;
      }

      // 4. The same primitives at both ends: a slide, or a surface that gives way.
      if (alike(*here, *there)) {
        if (!here->set.empty()) {
          const Slide slide = slide_along(*here, *there, *between, share, balance, result);
          if (slide == Slide::kGaveWay) std::swap(here, there);
          if (slide != Slide::kWent) continue;
        }
        // The way is at its end.
        if (share == 1.0) {
          result.proxy = balance.proxy;
          return result;
        }
        if (!here->set.empty()) place(*there);
      }

      // 5. The next piece may be longer.
      strides_per_piece_ = std::min(1.0, 2.0 * strides_per_piece_);
      std::swap(here, there);
    }
    // Out of pieces: the proxy stays where the way was cut, with the primitives of that place.
    result.proxy = point_.carriers.empty() ? probe_ : last_at();
    return result;
  }

 private:
  /// What became of a piece with the same primitives at both ends.
  enum class Slide : uint8_t {
    kWent,     ///< the carriers are `share` of the way to balance.proxy
    kGaveWay,  ///< they are, with what `there` holds, where the surface gave way
    kBends,    ///< they are where the piece began
  };

  /// Repeats a piece from `here`, which went straight to `there`, with the primitives that hold on
  /// the way (midpoint rule). share, balance, result: of the straight piece, then of this one.
  Slide slide_along(const Placed& here, Placed& there, Placed& between, double& share,
                    Balance& balance, Sweep& result) noexcept {
    // A surface that gives way early is followed in shorter pieces.
    const double balanced = where_forces_balance(here, there, way_, share);
    reset();
    if (balanced < kGivesWay * share) {
      advance(balanced, balance.proxy);
      place(there);
      strides_per_piece_ *= 0.5;
      return Slide::kGaveWay;
    }
    // So is one that bends; a slide along the rest goes by the mean of both ends.
    if (strides_per_piece_ > kShortestPiece && bends(here, there, stiffness_)) {
      strides_per_piece_ *= 0.5;
      return Slide::kBends;
    }
    mean(here, there, between);
    const glm::dvec3 straight = balance.proxy;
    balance = solve(between, result);
    balance.proxy = bent(here, there, straight, balance.proxy, kShort_m, stiffness_);
    measure(balance.proxy);
    share = length_ > 0.0 ? std::min(1.0, strides_per_piece_ / strides_) : 1.0;
    balance.proxy = on_surface(here, there, share, balance.proxy);
    advance(share, balance.proxy);
    return Slide::kWent;
  }

  Balance solve(const Placed& placed, Sweep& result) const noexcept {
    const Balance balance = palpate::balance(placed.set, probe_, stiffness_, &point_.hint);
    result.primitives = placed.set.count();
    result.residual_n = balance.residual_n;
    result.touching = false;
    for (const Primitive& p : placed.set)
      result.touching |= p.kind != Primitive::Kind::kPlane ||
                         glm::dot(placed.pull - p.position, p.direction) < 0.0;
    return balance;
  }

  void place(Placed& placed) noexcept {
    samples_ += int(run_.modes.size());
    placed.set.clear();
    placed.drag_n_s_per_m = 0.0;
    placed.drag_at_n_s = glm::dvec3(0.0);
    for (size_t m = 0; m < run_.modes.size(); ++m) {
      const ModeRun& mode = run_.modes[m];
      const SceneMode& plan = run_.scene->modes[m];
      CarrierRun& carrier = point_.carriers[plan.carrier];
      const double weight = mode.weight * mode.gain * carrier.fade;
      if (!(weight > 0.0)) continue;
      const int before = placed.set.count();
      const double dragged = placed.drag_n_s_per_m;
      carrier.carrier->place(plan, hand_, dt_s_, weight, carrier.cap_n * carrier.fade, placed);
      double strongest = 0.0;
      for (int i = before; i < placed.set.count(); ++i) {
        placed.owner[i] = uint8_t(m);
        strongest = std::max(strongest, placed.set[i].strength_n);
      }
      point_.modes[m].placed_n = strongest / weight;
      placed.drag_at_n_s += (placed.drag_n_s_per_m - dragged) * carrier.material_m;
    }
    pull(placed);
  }

  void pull(Placed& placed) const noexcept {
    placed.pull = probe_;
    for (const Primitive& p : placed.set)
      if (p.kind == Primitive::Kind::kForce)
        placed.pull += p.direction * (p.strength_n / stiffness_);
  }

  /// Damper and spring are one spring: b/(2 dt) |x - a|^2 + k/2 |x - probe|^2 is, but for a
  /// constant, (k + b/dt)/2 |x - y|^2 with y between a and the probe.
  void join_drag(Placed& here) noexcept {
    const glm::dvec3 material = here.drag_at_n_s / here.drag_n_s_per_m;
    const double together = stiffness_ + here.drag_n_s_per_m / std::max(dt_s_, kShortestDrag_s);
    probe_ = material + (stiffness_ / together) * (hand_ - material);
    stiffness_ = together;
    pull(here);
  }

  /// How far it is to a point, in metres and in strides of the carrier with the shortest stride;
  /// and the direction of each carrier's own way, which differ where volumes move.
  void measure(glm::dvec3 to) noexcept {
    strides_ = length_ = 0.0;
    way_ = glm::dvec3(0.0);
    for (size_t c = 0; c < point_.carriers.size(); ++c) {
      const CarrierRun& run = point_.carriers[c];
      ways_[c] = glm::dvec3(0.0);
      if (run.frozen) continue;
      const glm::dvec3 d = to - run.carrier->at();
      const double length = glm::length(d);
      if (length >= length_) way_ = d;
      if (length > 0.0) ways_[c] = d / length;
      length_ = std::max(length_, length);
      strides_ = std::max(strides_, length / run.carrier->stride_m());
    }
  }

  /// Moves every carrier by the share of its way to a point. One that can not follow is set back to
  /// where the frame began, so that the force felt there fades. Where it failed it may already have
  /// been off the surface, and the force would end at once.
  void advance(double share, glm::dvec3 to) noexcept {
    for (size_t c = 0; c < point_.carriers.size(); ++c) {
      CarrierRun& run = point_.carriers[c];
      if (run.frozen) continue;
      const glm::dvec3 from = run.carrier->at();
      if (run.carrier->go_to(share == 1.0 ? to : from + share * (to - from))) continue;
      run.frozen = true;
      run.carrier->reset(starts_[c]);
    }
  }

  void mark() noexcept {
    for (size_t c = 0; c < point_.carriers.size(); ++c)
      marks_[c] = point_.carriers[c].carrier->mark();
  }
  void reset() noexcept {
    for (size_t c = 0; c < point_.carriers.size(); ++c)
      if (!point_.carriers[c].frozen) point_.carriers[c].carrier->reset(marks_[c]);
  }

  /// How fast the way of its mode's carrier leads out of plane i, per length: below 0, against it.
  double rise(const Placed& placed, int i) const noexcept {
    return glm::dot(ways_[size_t(run_.scene->modes[placed.owner[i]].carrier)],
                    placed.set[i].direction);
  }

  /// The modes whose surface the proxy stands on as it starts, and does not press through: the
  /// spring presses on it, or something else does and the way leads along it.
  uint32_t stood_on(const Placed& placed) const noexcept {
    uint32_t modes = 0;
    for (int i = 0; i < placed.set.count(); ++i) {
      const Primitive& p = placed.set[i];
      if (p.kind == Primitive::Kind::kPlane &&
          (glm::dot(placed.pull - p.position, p.direction) <= 0.0 || rise(placed, i) <= kAlong) &&
          margin_n(placed, i, stiffness_) >= 0.0)
        modes |= 1u << placed.owner[i];
    }
    return modes;
  }

  /// A slide that is to end at share of the way to a point, corrected by the data at `there`:
  /// sliding along a surface does not change the value. Without this, small errors add up, and on
  /// rough data the proxy creeps through a thin surface.
  glm::dvec3 on_surface(const Placed& here, const Placed& there, double share,
                        glm::dvec3 to) const noexcept {
    for (int i = 0; i < here.set.count(); ++i) {
      const double slope = there.surface_value[i].slope_per_m;
      if (slope == 0.0 || here.surface_value[i].slope_per_m == 0.0 ||
          !slides(here, there, i, stiffness_))
        continue;
      const Primitive& p = there.set[i];
      const glm::dvec3 from = here.set[i].position, way = share * (to - from);
      const double ahead = glm::dot(from + way - p.position, p.direction);
      const double back =
          (here.surface_value[i].value - there.surface_value[i].value) / slope - ahead;
      const double most = kMostBack * glm::length(way);
      to += p.direction * (std::clamp(back, -most, most) / share);
    }
    return to;
  }

  /// Surfaces that were newly met: from now on the proxy stays at their iso-values.
  void keep_iso_values(const Placed& there, uint32_t met) noexcept {
    for (int i = 0; i < there.set.count(); ++i) {
      if (!(met >> there.owner[i] & 1u) || there.surface_value[i].slope_per_m == 0.0) continue;
      PointMode& mode = point_.modes[there.owner[i]];
      mode.on_surface = true;
      mode.iso_value = there.surface_value[i].value;
    }
  }

  /// What the time since the last frame did to the surfaces that the proxy rests on: where the
  /// values at its point of the material have grown, the surface that was met has moved out past
  /// it. It takes the proxy along as soon as it has sunk in by a good part of a voxel. Nothing else
  /// would ever bring it out again: values fall short here and there as they change, each time it
  /// sinks, and in the end it is through a surface that never yielded. A surface that yields, or
  /// that nothing presses on, is not kept to any longer.
  void follow_surfaces(Placed& here) noexcept {
    uint32_t kept = 0, pressed_on = 0;
    for (size_t m = 0; m < point_.modes.size(); ++m)
      kept |= uint32_t(point_.modes[m].on_surface) << m;
    if (!kept) return;
    glm::dvec3 way(0.0);
    for (int i = 0; i < here.set.count(); ++i) {
      if (!(kept >> here.owner[i] & 1u) || !slides(here, here, i, stiffness_)) continue;
      pressed_on |= 1u << here.owner[i];
      if (here.surface_value[i].slope_per_m == 0.0) continue;
      const glm::dvec3 out = here.set[i].direction;
      const double deep = (point_.modes[here.owner[i]].iso_value - here.surface_value[i].value) /
                              here.surface_value[i].slope_per_m -
                          glm::dot(way, out);
      const double stride = carrier_of(here.owner[i]).carrier->stride_m();
      way += out * std::clamp(deep - kSunk * stride, 0.0, kMostFollowed * stride);
    }
    for (size_t m = 0; m < point_.modes.size(); ++m)
      point_.modes[m].on_surface = (kept & pressed_on) >> m & 1u;
    if (way == glm::dvec3(0.0)) return;
    for (CarrierRun& run : point_.carriers)
      if (!run.frozen && !run.carrier->go_to(run.carrier->at() + way)) run.frozen = true;
    place(here);
  }
  CarrierRun& carrier_of(int mode) const noexcept {
    return point_.carriers[run_.scene->modes[mode].carrier];
  }

  /// The modes of which a plane stands against the way and would hold.
  uint32_t against(const Placed& placed) const noexcept {
    uint32_t modes = 0;
    for (int i = 0; i < placed.set.count(); ++i) {
      const Primitive& p = placed.set[i];
      if (p.kind == Primitive::Kind::kPlane && rise(placed, i) < -kAgainst &&
          margin_n(placed, i, stiffness_) >= 0.0)
        modes |= 1u << placed.owner[i];
    }
    return modes;
  }

  /// By how much the strongest plane of the modes asked for is stronger than the spring that
  /// presses on it, N; where they have none, by how much the spring pulls.
  double margin(const Placed& placed, uint32_t modes) const noexcept {
    double best = -stiffness_ * length_;
    for (int i = 0; i < placed.set.count(); ++i) {
      const Primitive& p = placed.set[i];
      if (p.kind == Primitive::Kind::kPlane && (modes >> placed.owner[i] & 1u) &&
          rise(placed, i) < -kAgainst)
        best = std::max(best, margin_n(placed, i, stiffness_));
    }
    return best;
  }

  /// Between the marks and `share` of the way to a point a surface begins to hold: stops just
  /// inside of where. Regula falsi with the Illinois change, and halving where the strength is a
  /// step.
  void find_contact(uint32_t modes, double share, glm::dvec3 to, Placed& placed) noexcept {
    // free: shares at which nothing holds yet; inside: at which it does.
    double free = 0.0, inside = share;
    double free_margin = 0.0, inside_margin = margin(placed, modes);
    bool known = false;  // the margin at `free`
    const double way = length_;
    int sides = 0;
    for (int i = 0; i < kMostHalvings && (inside - free) * way > kContact_m; ++i) {
      // Halving, or the secant while it does not keep to one side.
      double at = 0.5 * (free + inside);
      if (known && sides < 2) {
        const double secant = free + (inside - free) * free_margin / (free_margin - inside_margin);
        // Never closer to an end than a tenth of the tolerance: the next interval must be shorter.
        const double guard = std::min(0.1 * kContact_m / way, 0.25 * (inside - free));
        if (std::isfinite(secant)) at = std::clamp(secant, free + guard, inside - guard);
      }
      reset();
      advance(at, to);
      place(placed);
      // Which end the new place replaces.
      const double found = margin(placed, modes);
      if (found >= 0.0) {
        sides = inside_side_ ? sides + 1 : 0;
        inside_side_ = true;
        inside = at;
        inside_margin = found;
      } else {
        sides = inside_side_ ? 0 : sides + 1;
        inside_side_ = false;
        free = at;
        free_margin = found;
        known = true;
      }
    }
    reset();
    advance(inside, to);
    place(placed);
  }

  glm::dvec3 last_at() const noexcept {
    for (const CarrierRun& run : point_.carriers)
      if (!run.frozen) return run.carrier->at();
    return point_.carriers.front().carrier->at();
  }

  HapticRun& run_;
  PointRun& point_;
  glm::dvec3 hand_;
  // Where the spring that the primitives act against is fixed, and its stiffness: the hand's, or
  // with the damper of viscous material both together.
  glm::dvec3 probe_;
  double stiffness_, dt_s_;
  double strides_ = 0.0, length_ = 0.0;
  glm::dvec3 way_{0.0};             // the longest of the carriers' ways
  double strides_per_piece_ = 1.0;  // strides to a piece
  bool inside_side_ = false;
  int samples_ = 0;
  std::array<Carrier::Mark, kMostCarriers> marks_, starts_;
  std::array<glm::dvec3, kMostCarriers> ways_;
};

}  // namespace

Sweep sweep(HapticRun& run, PointRun& point, glm::dvec3 probe, double stiffness_n_per_m,
            double dt_s) noexcept {
  return Way(run, point, probe, stiffness_n_per_m, dt_s).go();
}

}  // namespace palpate
