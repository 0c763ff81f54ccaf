#include "tests/lab/stability/loop_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "module/haptics/proxy/delay_lead.h"
#include "tests/lab/stability/guarded_wall.h"
#include "tests/lab/stability/leaning_hand.h"

namespace palpate::stability {
namespace {

constexpr double kLoopPeriod_s = 1e-3;
constexpr int kHandCount = 5;
constexpr std::array<devices::HandImpedance, kHandCount> kHands = {
    devices::kNoHand, devices::kLooseHand, devices::kHumanHand, devices::kFirmHand,
    devices::HandImpedance{.stiffness_n_per_m = 500.0}};
// The accuracy of the tank's energy accounting.
constexpr double kRounding_j = 1e-6;

StabilityMap spring_wall_map(const char* name, const char* title) {
  StabilityMap map;
  map.group = "loop";
  map.name = name;
  map.title = title;
  map.failed =
      "the grip goes on swinging by more than two counts of the encoder after it should be at rest";
  map.harder_along_y = true;
  map.colour = "swing that stays";
  map.colour_unit = "um";
  map.logarithmic = true;
  map.lowest = 1.0;
  map.highest = 1e4;
  constexpr const char* kFlag = "lowers the force and names the cause";
  map.sides = {{"the plain loop", "", {}},
               {"palpate at a device it knows nothing of", kFlag, {}},
               {"palpate", kFlag, {}}};
  return map;
}

const char* const kStable = "K = b / (T/2 + delay) (Colgate and Schenkel)";
const char* const kShare = "stiffness, as a share of the limit";
const char* const kConsent = "b (2 pi f A)^2 / 2 = the allowance of 0.05 W";

Cell worse(const Cell& a, const Cell& b) {
  return {std::max(a.value, b.value), std::max(a.outcome, b.outcome)};
}

StabilityMap leaning_map(const char* name, const char* title) {
  StabilityMap map;
  map.group = "loop";
  map.name = name;
  map.title = title;
  map.failed = "the hand gets more work than it consented to, or the surface slips past";
  map.colour = "work on the hand beyond its consent";
  map.colour_unit = "J";
  map.logarithmic = true;
  map.lowest = 1e-4;
  map.highest = 10.0;
  map.sides = {{"palpate without its tank", "", {}},
               {"palpate", "lets the surface slip past, and its tank tells how much", {}}};
  return map;
}

Cell energy_cell(const LeaningCase& at, bool tank) {
  const LeaningResult result = lean(at, tank);
  Cell cell;
  cell.value = std::max(0.0, result.beyond_j);
  if (result.beyond_j > kRounding_j)
    cell.outcome = Outcome::kSilent;
  else if (result.refused_j > kRounding_j)
    cell.outcome = Outcome::kFlagged;
  return cell;
}

}  // namespace

Cell loop_cell(const LoopPoint& at, int hand, Loop loop, uint32_t seed) {
  // Press, impact and the wall's place are random.
  StabilityCase of = stability_case(seed, 1.0);
  of.body = {.mass_kg = 0.15,
             .damping_n_s_per_m = at.damping_n_s_per_m,
             .coulomb_n = at.coulomb_n,
             .hand = kHands[size_t(hand)]};
  of.hand = hand;
  of.delay_s = at.delay_s;
  of.offset_m = of.resolution_m > 0.0 ? of.offset_m / of.resolution_m * at.resolution_m : 0.0;
  of.resolution_m = at.resolution_m;
  of.jitter_s = at.jitter_s;
  // Below the limit it needs time to come to rest; beyond, the oscillation shows soon.
  of.longest_s = at.stiffness_share < 1.0 || loop == Loop::kPalpate ? 500.0 : at.longest_s;
  of.stiffness_n_per_m =
      at.stiffness_share * stable_stiffness(at.damping_n_s_per_m, kLoopPeriod_s, at.delay_s);
  const StabilityResult result =
      loop == Loop::kPlain ? run_stability(of, 0.0) : run_guarded(of, loop == Loop::kPalpate);
  Cell cell{1e6 * result.swing_m, Outcome::kHeld};
  if (result.limit_cycle) cell.outcome = result.heard ? Outcome::kFlagged : Outcome::kSilent;
  return cell;
}

Cell loop_cell(const LoopPoint& at, Loop loop, uint32_t seed) {
  Cell worst;
  for (int hand = 0; hand < kHandCount; ++hand)
    worst = worse(worst, loop_cell(at, hand, loop, seed + uint32_t(hand)));
  return worst;
}

Cell swing_cell(double hz, double amplitude_m, bool tank, double seconds) {
  return energy_cell({.amplitude_m = amplitude_m, .swing_hz = hz, .seconds = seconds}, tank);
}

Cell beat_cell(double hz, double stiffness_n_per_m, bool tank, double seconds) {
  return energy_cell({.beats_hz = hz, .stiffness_n_per_m = stiffness_n_per_m, .seconds = seconds},
                     tank);
}

double consented_amplitude_m(double hz) {
  const double omega = 2.0 * std::numbers::pi * hz;
  return std::sqrt(2.0 * EnergyTankOptions{}.allowance_w / leaning_damping_n_s_per_m()) / omega;
}

StabilityMap stiffness_map(const Making& making) {
  StabilityMap map = spring_wall_map("stiffness-and-delay", "A stiff wall and a late force");
  map.made =
      "A device of 0.15 kg and 2 N s/m with an encoder of 38 um, in five hands one after the "
      "other, touches a spring wall and rests on it; the worst of the five is shown.";
  map.x = even_axis("delay", "ms", 0.0, 3.0, making.count(4, 10));
  map.y = log_axis("stiffness", "N/m", 200.0, 8000.0, making.count(5, 12));
  map.borders = {border_along_x(kStable, evenly(0.0, 3.2, 65), [](double delay_ms) {
    return stable_stiffness(2.0, kLoopPeriod_s, 1e-3 * delay_ms);
  })};
  fill(map, making, [&](size_t side, double delay_ms, double stiffness) {
    LoopPoint at{.delay_s = 1e-3 * delay_ms};
    at.stiffness_share = stiffness / stable_stiffness(2.0, kLoopPeriod_s, at.delay_s);
    return loop_cell(at, Loop(side), cell_seed(making.seed, delay_ms, stiffness));
  });
  return map;
}

StabilityMap damping_map(const Making& making) {
  StabilityMap map = spring_wall_map("damping", "A stiff wall and little damping");
  map.made =
      "The same five hands on devices with 1 ms of delay; the wall's stiffness is told as a share "
      "of what the device should hold.";
  map.x = log_axis("damping of the device", "N s/m", 0.1, 10.0, making.count(4, 9));
  map.y = even_axis(kShare, "", 0.5, 2.0, making.count(4, 11));
  map.borders = {border_at_y(kStable, 1.0, map.x)};
  fill(map, making, [&](size_t side, double damping, double share) {
    return loop_cell({.stiffness_share = share, .damping_n_s_per_m = damping}, Loop(side),
                     cell_seed(making.seed, damping, share));
  });
  return map;
}

StabilityMap hands_map(const Making& making) {
  StabilityMap map = spring_wall_map("hands", "A stiff wall in different hands");
  map.made =
      "One device (0.15 kg, 2 N s/m, 1 ms of delay, 38 um) in each hand; a weight presses where "
      "there is no hand, and the spring is a hand without mass or damping: the worst that is "
      "passive.";
  map.x = {"hand", "", {0.0, 1.0, 2.0, 3.0, 4.0}, false, {}};
  for (int hand = 0; hand < kHandCount; ++hand) map.x.words.emplace_back(hand_name(hand));
  map.y = even_axis(kShare, "", 0.5, 3.0, making.count(5, 11));
  map.borders = {border_at_y(kStable, 1.0, map.x)};
  fill(map, making, [&](size_t side, double hand, double share) {
    return loop_cell({.stiffness_share = share}, int(hand), Loop(side),
                     cell_seed(making.seed, hand, share));
  });
  return map;
}

StabilityMap jitter_map(const Making& making) {
  StabilityMap map = spring_wall_map("jitter", "A stiff wall and an uneven loop");
  map.made =
      "The same device in the same five hands; every period of the loop is longer or shorter than "
      "1 ms by up to the jitter, at random.";
  map.x = even_axis("jitter", "ms", 0.0, 0.9, making.count(4, 10));
  map.y = even_axis(kShare, "", 0.4, 2.0, making.count(4, 9));
  // The worst case is the longest period all the time.
  map.borders = {border_at_y(kStable, 1.0, map.x),
                 border_along_x("the limit of a loop whose every period is the longest",
                                evenly(0.0, 1.0, 33), [](double j) {
                                  return stable_stiffness(2.0, (1.0 + j) * kLoopPeriod_s, 1e-3) /
                                         stable_stiffness(2.0, kLoopPeriod_s, 1e-3);
                                })};
  fill(map, making, [&](size_t side, double jitter_ms, double share) {
    return loop_cell({.stiffness_share = share, .jitter_s = 1e-3 * jitter_ms}, Loop(side),
                     cell_seed(making.seed, jitter_ms, share));
  });
  return map;
}

StabilityMap encoder_map(const Making& making) {
  StabilityMap map = spring_wall_map("encoder", "A stiff wall and a coarse encoder");
  map.made =
      "The same device with 0.03 N of dry friction and a coarser encoder, in the same five hands.";
  map.x = log_axis("encoder step", "um", 1.0, 200.0, making.count(4, 9));
  map.y = log_axis("stiffness", "N/m", 200.0, 8000.0, making.count(5, 11));
  constexpr double kCoulomb_n = 0.03;
  const double stable = stable_stiffness(2.0, kLoopPeriod_s, 1e-3);
  map.borders = {
      border_at_y(kStable, stable, map.x),
      border_along_x("K = 2 friction / step (Abbott and Okamura)", log_evenly(0.7, 300.0, 33),
                     [](double um) { return 2.0 * kCoulomb_n / (1e-6 * um); })};
  fill(map, making, [&](size_t side, double um, double stiffness) {
    return loop_cell(
        {.stiffness_share = stiffness / stable, .resolution_m = 1e-6 * um, .coulomb_n = kCoulomb_n},
        Loop(side), cell_seed(making.seed, um, stiffness));
  });
  return map;
}

StabilityMap swing_map(const Making& making) {
  StabilityMap map = leaning_map("dragged", "A volume that is dragged to and fro under the hand");
  map.made =
      "A human hand leans 10 mm into a ball that swings along the hand's way, 1000 N/m, for 10 s "
      "(3 s in the quick run).";
  map.x = log_axis("swings per second", "Hz", 0.1, 10.0, making.count(5, 11));
  map.y = log_axis("amplitude", "mm", 0.5, 50.0, making.count(4, 10));
  map.borders = {border_along_x(kConsent, log_evenly(0.08, 13.0, 33),
                                [](double hz) { return 1e3 * consented_amplitude_m(hz); })};
  fill(map, making, [&](size_t side, double hz, double mm) {
    return swing_cell(hz, 1e-3 * mm, side == 1, making.quick ? 3.0 : 10.0);
  });
  return map;
}

StabilityMap beat_map(const Making& making) {
  StabilityMap map = leaning_map("beating", "Data that beat under the hand");
  map.made =
      "A human hand leans 10 mm into a ball whose data beat by 10 mm in radius, for 10 s (3 s in "
      "the quick run).";
  map.x = log_axis("beats per second", "Hz", 0.5, 10.0, making.count(4, 9));
  map.y = log_axis("stiffness", "N/m", 50.0, 4000.0, making.count(4, 9));
  // The wall's amplitude is half of the change of its radius.
  double limit_hz = 0.1;
  while (consented_amplitude_m(limit_hz) > 0.005) limit_hz *= 1.001;
  map.borders = {border_at_x(kConsent, limit_hz, map.y)};
  fill(map, making, [&](size_t side, double hz, double stiffness) {
    return beat_cell(hz, stiffness, side == 1, making.quick ? 3.0 : 10.0);
  });
  return map;
}

}  // namespace palpate::stability
