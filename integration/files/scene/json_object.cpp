#include "integration/files/scene/json_object.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

using nlohmann::json;

const char* kind_of(const json& value) {
  switch (value.type()) {
    case json::value_t::null:
      return "null";
    case json::value_t::object:
      return "an object";
    case json::value_t::array:
      return "a list";
    case json::value_t::string:
      return "a text";
    case json::value_t::boolean:
      return "true or false";
    default:
      return "a number";
  }
}

/// What stands in messages: long or binary keys of strangers are cut.
std::string in_quotes(std::string_view text) {
  std::string clean;
  for (const char c : text.substr(0, 60)) clean += c >= ' ' && c != '\x7f' ? c : '?';
  return "\"" + clean + (text.size() > 60 ? "...\"" : "\"");
}

}  // namespace

void JsonReading::refuse(const std::string& place, const std::string& what) {
  if (error) return;
  const char* end = what.ends_with('?') ? "" : ".";
  error = place.empty() ? bad_input(file, "can not be used: {}{}", what, end)
                        : bad_input(file, "at {}: {}{}", place, what, end);
}

size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  std::iota(above.begin(), above.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t change = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({change, above[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above.back();
}

std::string nearest_word(std::string_view word, const std::vector<std::string_view>& known) {
  // Words longer than any key are no typing errors, and the time for a distance grows with the
  // product of both lengths.
  if (word.size() > 60) return {};
  std::string_view best;
  size_t least = word.size() / 2 + 1;
  for (const std::string_view candidate : known) {
    const size_t edits = edits_between(word, candidate);
    if (edits < least) least = edits, best = candidate;
  }
  if (!best.empty()) return std::string(best);
  // "strength_n" for "strength": an abbreviation, or a unit too many.
  for (const std::string_view candidate : known)
    if (word.size() > 2 && (candidate.starts_with(word) || word.starts_with(candidate)))
      return std::string(candidate);
  return {};
}

JsonObject::JsonObject(const json& value, std::string place, JsonReading& reading)
    : value_(value), place_(std::move(place)), reading_(reading) {
  if (!value_.is_object())
    reading_.refuse(place_, fmt::format("{} stands where an object is expected: write {{ ... }}",
                                        kind_of(value_)));
}

std::string JsonObject::place(std::string_view key) const {
  return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
}

void JsonObject::refuse(std::string_view key, const std::string& what) {
  reading_.refuse(place(key), what);
}

const json* JsonObject::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  if (reading_.accepted) {
    // "modes[1].strength" is the same key as "modes[0].strength".
    std::string general;
    bool inside = false;
    for (const char c : place(key)) {
      if (c == ']') inside = false;
      if (!inside) general += c;
      if (c == '[') inside = true;
    }
    reading_.accepted->insert(general);
  }
  if (!value_.is_object()) return nullptr;
  const auto found = value_.find(key);
  return found == value_.end() ? nullptr : &*found;
}

bool JsonObject::number(std::string_view key, double& out, const NumberRange& range) {
  const json* value = find(key);
  if (!value) return false;
  const double number = value->is_number() ? value->get<double>() : NAN;
  if (!is_in(number, range)) {
    refuse(key, fmt::format("{} stands where {} is expected: change it",
                            value->is_number() ? fmt::format("{}", number) : kind_of(*value),
                            text_of(range)));
    return false;
  }
  out = number;
  return true;
}

bool JsonObject::boolean(std::string_view key, bool& out) {
  const json* value = find(key);
  if (!value) return false;
  if (!value->is_boolean()) {
    refuse(key,
           fmt::format("{} stands where true or false is expected: change it", kind_of(*value)));
    return false;
  }
  out = value->get<bool>();
  return true;
}

bool JsonObject::text(std::string_view key, std::string& out) {
  const json* value = find(key);
  if (!value) return false;
  if (!value->is_string() || value->get_ref<const std::string&>().empty()) {
    refuse(key, fmt::format("{} stands where a text is expected: write \"...\"",
                            value->is_string() ? "an empty text" : kind_of(*value)));
    return false;
  }
  out = value->get<std::string>();
  return true;
}

bool JsonObject::vector(std::string_view key, glm::dvec3& out, const NumberRange& range) {
  const json* value = find(key);
  if (!value) return false;
  const auto is_fit = [&](const json& v) { return v.is_number() && is_in(v.get<double>(), range); };
  if (!value->is_array() || value->size() != 3 ||
      !std::all_of(value->begin(), value->end(), is_fit)) {
    refuse(key, fmt::format("a list of three numbers is expected, each {}: write [x, y, z]",
                            text_of(range)));
    return false;
  }
  for (int a = 0; a < 3; ++a) out[a] = (*value)[size_t(a)].get<double>();
  return true;
}

const json* JsonObject::list(std::string_view key) {
  const json* value = find(key);
  if (!value) return nullptr;
  if (!value->is_array() || value->empty()) {
    refuse(key, fmt::format("{} stands where a list is expected: write [ ... ] with at least one "
                            "entry",
                            value->is_array() ? "an empty list" : kind_of(*value)));
    return nullptr;
  }
  return value;
}

bool JsonObject::texts(std::string_view key, std::vector<std::string>& out) {
  if (value_.is_object() && value_.contains(key) && value_[key].is_string()) {
    std::string one;
    if (!text(key, one)) return false;
    out = {one};
    return true;
  }
  const json* value = list(key);
  if (!value) return false;
  out.clear();
  for (size_t k = 0; k < value->size(); ++k) {
    const json& one = (*value)[k];
    if (!one.is_string() || one.get_ref<const std::string&>().empty()) {
      reading_.refuse(fmt::format("{}[{}]", place(key), k),
                      fmt::format("{} stands where a file name is expected: write \"...\"",
                                  one.is_string() ? "an empty text" : kind_of(one)));
      return false;
    }
    out.push_back(one.get<std::string>());
  }
  return true;
}

void JsonObject::refuse_word(std::string_view key, const std::string& word,
                             const std::vector<std::string_view>& known) {
  const std::string near = nearest_word(word, known);
  refuse(key, fmt::format("{} is not known: {}use {}", in_quotes(word),
                          near.empty() ? "" : fmt::format("did you mean \"{}\"? Otherwise ", near),
                          fmt::join(known, ", ")));
}

void JsonObject::finish() {
  if (!value_.is_object() || !good()) return;
  const std::vector<std::string_view> known(known_.begin(), known_.end());
  for (const auto& [key, value] : value_.items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const std::string near = nearest_word(key, known);
    reading_.refuse(place_,
                    fmt::format("the key {} is not known: {}", in_quotes(key),
                                near.empty() ? fmt::format("known are {}", fmt::join(known, ", "))
                                             : fmt::format("did you mean \"{}\"?", near)));
    return;
  }
}

std::optional<json> parse_json(std::string_view text, JsonReading& reading) {
  std::vector<std::set<std::string>> open;
  std::optional<std::string> twice;
  const json::parser_callback_t look = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open.emplace_back();
    if (event == json::parse_event_t::object_end && !open.empty()) open.pop_back();
    if (event == json::parse_event_t::key && !open.empty() && !twice &&
        !open.back().insert(parsed.get<std::string>()).second)
      twice = parsed.get<std::string>();
    return true;
  };
  try {
    json value = json::parse(text, look, true, true);
    if (!twice) return value;
    reading.refuse(
        "", fmt::format("the key {} stands twice in one object: leave one out", in_quotes(*twice)));
  } catch (const json::parse_error& error) {
    const auto end = text.begin() + std::min(error.byte, text.size());
    const auto line = 1 + std::count(text.begin(), end, '\n');
    const auto start = std::find(std::make_reverse_iterator(end), text.rend(), '\n').base();
    reading.refuse("",
                   fmt::format("it is not JSON at line {}, column {}: look for a missing comma, "
                               "quote or bracket there",
                               line, end - start));
  } catch (const json::exception&) {
    // The parser throws this for numbers that no double can hold.
    reading.refuse("", "a number in it is too large: write it smaller");
  }
  return std::nullopt;
}

nlohmann::ordered_json list_of(glm::dvec3 v) {
  return {v.x, v.y, v.z};
}

nlohmann::ordered_json list_of(const glm::dquat& q) {
  return {q.w, q.x, q.y, q.z};
}

}  // namespace palpate::files
