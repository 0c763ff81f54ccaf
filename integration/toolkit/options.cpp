#include "integration/toolkit/options.h"

#include <fmt/format.h>

namespace palpate::toolkit {

Status check_number(std::string_view name, double value, const files::NumberRange& range) {
  if (files::is_in(value, range)) return Nothing{};
  return Error{ErrorKind::kBadInput, files::out_of_range(name, value, range)};
}

Status check_field(std::string_view name, double value, const files::NumberRange& range) {
  if (value == 0.0) return Nothing{};
  return check_number(name, value, range);
}

Status check_flags(std::string_view structure, uint32_t flags, uint32_t known) {
  if ((flags & ~known) == 0) return Nothing{};
  return Error{ErrorKind::kBadInput,
               fmt::format("{}.flags has bits that have no meaning ({:#x}): set the flags of "
                           "palpate.h alone, and the others to 0",
                           structure, flags & ~known)};
}

}  // namespace palpate::toolkit
