#include "integration/app/force_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "integration/app/option_checks.h"
#include "integration/devices/force_devices.h"
#include "integration/openigtlink/client.h"

namespace palpate::app {

CLI::Validator a_force_device(std::vector<std::string> others) {
  std::vector<std::string> words{"auto"};
  for (const auto& kind : devices::force_device_kinds()) words.emplace_back(kind.kind);
  words.insert(words.end(), others.begin(), others.end());
  CLI::Validator known = one_of(words);
  return CLI::Validator(
      [known](std::string& text) {
        if (openigtlink::is_address(text)) return std::string();
        const auto [word, address] = devices::force_device_name(text);
        std::string kind = word;
        const std::string wrong = known(kind);
        if (!wrong.empty()) return wrong + "; the Vulkan device is named with --gpu";
        if (text.find('@') == std::string::npos ||
            (devices::force_device_kind(word) && !address.empty()))
          return std::string();
        return fmt::format("'{}': only a real device has an address, as in haply@localhost:10001",
                           text);
      },
      known.get_description());
}

std::string devices_that_would_do() {
  std::vector<std::string> names;
  for (const auto& kind : devices::force_device_kinds()) names.emplace_back(kind.name);
  return fmt::format("a {}", fmt::join(names, ", a "));
}

}  // namespace palpate::app
