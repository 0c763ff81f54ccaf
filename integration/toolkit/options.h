#pragma once

#include <cstdint>
#include <string_view>

#include "compute/volume/result.h"
#include "integration/files/scene/option_ranges.h"

namespace palpate::toolkit {

/// An option that a host has given in a structure or to a function: kBadInput, with its name, its
/// value and the range, where it is outside.
Status check_number(std::string_view name, double value, const files::NumberRange& range);
/// The same for a field of a structure, where 0 is the default.
Status check_field(std::string_view name, double value, const files::NumberRange& range);
/// kBadInput for flags that are none of `known`.
Status check_flags(std::string_view structure, uint32_t flags, uint32_t known);

}  // namespace palpate::toolkit
