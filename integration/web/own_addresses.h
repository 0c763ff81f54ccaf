#pragma once

#include <string>
#include <vector>

namespace palpate::web {

/// The IPv4 addresses by which others reach this machine.
std::vector<std::string> own_addresses();

}  // namespace palpate::web
