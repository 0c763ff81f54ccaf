#include "integration/toolkit/options.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

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

nlohmann::json number(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

void OptionTaker::number(std::string_view key, double value) {
  if (value != 0.0) any(key, toolkit::number(value));
}

void OptionTaker::text(std::string_view key, const char* value) {
  if (value && *value) any(key, value);
}

void OptionTaker::flag(std::string_view key, uint32_t flags, uint32_t bit, bool value) {
  if (flags & bit) any(key, value);
}

void OptionTaker::any(std::string_view key, const nlohmann::json& value) {
  if (status_) status_ = running::set_option(request_, key, value);
}

void OptionTaker::all(const char* json, running::OptionStage stage) {
  if (status_ && json) status_ = running::set_options(request_, json, running::kCDoor, stage);
}

}  // namespace palpate::toolkit
