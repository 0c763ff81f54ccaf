#include "integration/running/felt_device.h"

#include <fmt/format.h>

#include "integration/devices/force_devices.h"
#include "integration/openigtlink/client.h"
#include "integration/running/simulated_hand.h"
#include "integration/running/tool_source.h"

namespace palpate::running {
namespace {

constexpr double kControllerSettle_per_s = 150.0;  // joins frames of 11 ms
constexpr double kMouseStart = 0.9;  // of the reach, towards the person: in front of all data

FeltDevice of_probe(const PositionSourceOptions& options, PositionSource* FeltDevice::*member,
                    std::string why) {
  auto probe = std::make_unique<PositionSource>(options);
  FeltDevice felt;
  if (member) felt.*member = probe.get();
  felt.device = std::move(probe);
  felt.why = std::move(why);
  felt.is_harmless = true;
  return felt;
}

FeltDevice mouse(std::string why) {
  PositionSourceOptions options;
  options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
  return of_probe(options, &FeltDevice::mouse, std::move(why));
}

FeltDevice page() {
  PositionSourceOptions options;
  options.kind = "page";
  options.waits = true;
  return of_probe(options, &FeltDevice::page,
                  "a pointer in the page, or a headset's controller; it gives no force.");
}

FeltDevice controller(std::string why) {
  // Like a tracked tool, in true size, but with 90 or more positions a second.
  PositionSourceOptions options = tool_probe();
  options.kind = "controller";
  options.settle_per_s = kControllerSettle_per_s;
  return of_probe(options, &FeltDevice::controller, std::move(why));
}

FeltDevice nothing() {
  // A probe that is never moved, outside the data.
  PositionSourceOptions options;
  options.kind = "none";
  options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
  return of_probe(options, nullptr, "none: viewing only.");
}

FeltDevice tool() {
  FeltDevice felt =
      of_probe(tool_probe(), &FeltDevice::tool, "tracked tool, as asked; it gives no force.");
  felt.has_true_size = true;
  return felt;
}

Result<FeltDevice> simulated(const SessionRequest& request, LoadedScene& scene, bool fit,
                             ServoClock* clock, const std::string& why) {
  auto hand = simulated_hand({request.hand, request.path, request.lets_go_s, clock}, scene, fit);
  if (!hand) return hand.error();
  FeltDevice felt;
  felt.why = why + " " + hand->sentence;
  felt.is_simulated = felt.is_harmless = true;
  felt.path_s = hand->path_s;
  felt.device = std::move(hand->device);
  return felt;
}

Result<FeltDevice> real_or_other(const SessionRequest& request, LoadedScene& scene, bool fit,
                                 const OtherHands& others) {
  auto device = devices::find_force_device(
      request.device, {"", request.falcon_firmware.string(), request.real_time});
  if (!device) return device.error();
  if (*device) {
    FeltDevice felt;
    felt.device = std::move(*device);
    const DeviceInfo info = felt.device->info();
    felt.why = fmt::format("{}{}{}", info.name, info.address.empty() ? "" : ", " + info.address,
                           request.device == "auto" ? ", which is there." : ", as asked.");
    return felt;
  }
  if (others.headset)
    return controller(
        "controller, as no force device is there; vibration says what force it would be.");
  if (others.window) return mouse("mouse, as no force device is there; it gives no force.");
  if (others.simulated)
    return simulated(request, scene, fit, others.clock,
                     "simulated device, as no force device is there.");
  return Error{ErrorKind::kNoDevice,
               "No force device answers: plug one in, or give one of your own (PalDevice)"};
}

}  // namespace

Result<FeltDevice> open_felt_device(const SessionRequest& request, LoadedScene& scene, bool fit,
                                    const OtherHands& others) {
  const auto opened = [&]() -> Result<FeltDevice> {
    if (request.device == "none") return nothing();
    if (request.device == "simulated")
      return simulated(request, scene, fit, others.clock, "simulated device, as asked.");
    if (request.device == "mouse") {
      if (!others.window)
        return Error{ErrorKind::kBadInput, "A mouse can be the hand only where there is a window"};
      return mouse("mouse, as asked; it gives no force.");
    }
    if (request.device == "page" && others.page) return page();
    if (openigtlink::is_address(request.device)) return tool();
    if (request.device == "controller") {
      if (!others.headset)
        return Error{ErrorKind::kBadInput,
                     "A controller can be the hand only where there is a headset"};
      return controller("controller, as asked; vibration says what force it would be.");
    }
    return real_or_other(request, scene, fit, others);
  };
  auto felt = opened();
  if (!felt) return felt;
  felt->info = felt->device->info();
  if (fit && !felt->is_simulated && !felt->has_true_size) fit_to_reach(scene, felt->info);
  return felt;
}

}  // namespace palpate::running
