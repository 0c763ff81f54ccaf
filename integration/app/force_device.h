#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace palpate::app {

/// The valid values of --device: "auto", the kinds of real devices, and `others`. Kinds that can
/// have an address may be followed by one.
CLI::Validator a_force_device(std::vector<std::string> others);

/// "Plug in a Novint Falcon, ...": advice for a user without a force device.
std::string devices_that_would_do();

}  // namespace palpate::app
