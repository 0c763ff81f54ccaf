#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "compute/volume/result.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/running/session_options.h"

namespace palpate::toolkit {

/// A number that a host has given to a function: kBadInput, with its name, its value and the range,
/// where it is outside.
Status check_number(std::string_view name, double value, const files::NumberRange& range);
/// The same for a field of a structure, where 0 is the default.
Status check_field(std::string_view name, double value, const files::NumberRange& range);
/// kBadInput for flags that are none of `known`.
Status check_flags(std::string_view structure, uint32_t flags, uint32_t known);

/// A number as JSON. JSON has no number that is not finite: those become the texts "nan", "inf" and
/// "-inf", which set_option() refuses as it refuses numbers outside the range.
nlohmann::json number(double value);

/// Passes the fields of a structure to a request as options, and keeps the first error.
class OptionTaker {
 public:
  explicit OptionTaker(running::SessionRequest& request) : request_(request) {}

  /// A field in which 0 is the default.
  void number(std::string_view key, double value);
  /// A field in which NULL is the default.
  void text(std::string_view key, const char* value);
  /// A bit that changes a flag from its default.
  void flag(std::string_view key, uint32_t flags, uint32_t bit, bool value);
  void any(std::string_view key, const nlohmann::json& value);
  /// The text of options of a structure; NULL: none.
  void all(const char* json, running::OptionStage stage);

  const Status& status() const { return status_; }

 private:
  running::SessionRequest& request_;
  Status status_ = Nothing{};
};

}  // namespace palpate::toolkit
