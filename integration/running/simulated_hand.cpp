#include "integration/running/simulated_hand.h"

#include <fmt/format.h>

#include "integration/devices/simulated_paths.h"
#include "integration/running/touch.h"

namespace palpate::running {
namespace {

constexpr int kTimesWhileWaiting = 100;

/// Options without a path. Errors: kBadInput for an unknown hand.
Result<devices::SimulatedOptions> options_of(const HandChoice& choice) {
  devices::SimulatedOptions options;
  options.real_time = true;
  options.clock = choice.clock;
  options.lets_go_at_s = choice.lets_go_at_s;
  if (choice.hand == "human")
    options.body.hand = devices::kHumanHand;
  else if (choice.hand == "loose")
    options.body.hand = devices::kLooseHand;
  else if (choice.hand == "firm")
    options.body.hand = devices::kFirmHand;
  else if (choice.hand == "none")
    options.body.hand = devices::kNoHand;
  else
    return Error{
        ErrorKind::kBadInput,
        fmt::format("There is no hand '{}': choose one of human, loose, firm, none", choice.hand)};
  return options;
}

}  // namespace

Result<SimulatedHand> simulated_hand(const HandChoice& choice, LoadedScene& scene, bool fit) {
  auto options = options_of(choice);
  if (!options) return options.error();
  const DeviceInfo info = devices::info_of(*options);
  // Before a place to touch is searched: the data must already be scaled.
  if (fit) fit_to_reach(scene, info);
  const auto touch = place_to_touch(scene, info);
  devices::PathPlace place;
  if (touch) {
    place = *touch;
  } else {
    // Nothing to press: the hand circles around the middle of the data.
    place.surface_m = info.workspace_centre_m;
    place.reach_m = 0.4 * info.workspace_radius_m;
    place.depth_m = 0.0;
    place.clearance_m = 0.2 * info.workspace_radius_m;
    place.times = 2;
  }
  const bool circle = !touch && choice.path == "press";
  const std::string name = circle ? "circle" : choice.path;
  const auto once = devices::path_named(name, place);
  if (!once) return once.error();
  // While motion is being estimated the hand continues.
  if (!scene.missing.empty()) place.times = kTimesWhileWaiting;
  const auto path = devices::path_named(name, place);
  if (!path) return path.error();
  options->path = *path;
  // A finger pad is held flat on the wall.
  if (scene.spec.tool_points > 1) {
    options->grip.turns = true;
    options->grip.device_from_grip =
        glm::dquat(glm::dvec3(0.0, 0.0, 1.0), glm::normalize(place.outward));
  }
  SimulatedHand hand;
  hand.path_s = once->duration_s();
  hand.sentence = circle ? "Its hand goes round in circles: there is no surface to press."
                         : fmt::format("Its hand follows the path '{}'.", choice.path);
  hand.device = std::make_unique<devices::SimulatedDevice>(std::move(*options));
  return hand;
}

}  // namespace palpate::running
