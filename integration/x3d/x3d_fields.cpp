#include "integration/x3d/x3d_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace palpate::x3d {
namespace {

constexpr std::string_view kBetween = " \t\r\n,";

}  // namespace

std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;
       at = text.find_first_not_of(kBetween, at)) {
    size_t end = text.find_first_of(kBetween, at);
    if (end == std::string_view::npos) end = text.size();
    // from_chars does not accept a leading plus; some of VHTK's scenes write one.
    const char* first = text.data() + at + (text[at] == '+' && end - at > 1 ? 1 : 0);
    double number = 0.0;
    const auto [stop, error] = std::from_chars(first, text.data() + end, number);
    if (error != std::errc() || stop != text.data() + end || !std::isfinite(number))
      return std::nullopt;
    numbers.push_back(number);
    at = end;
  }
  return numbers;
}

std::optional<bool> boolean_of(std::string_view text) {
  if (text == "true" || text == "TRUE" || text == "True") return true;
  if (text == "false" || text == "FALSE" || text == "False") return false;
  return std::nullopt;
}

std::vector<std::string> strings_of(std::string_view text) {
  const size_t first = text.find_first_not_of(kBetween);
  if (first == std::string_view::npos) return {};
  if (text[first] != '"' && text[first] != '\'') {
    const size_t last = text.find_last_not_of(kBetween);
    return {std::string(text.substr(first, last - first + 1))};
  }
  std::vector<std::string> strings;
  for (size_t at = first; at < text.size(); ++at) {
    const char mark = text[at];
    if (mark != '"' && mark != '\'') continue;
    std::string one;
    for (++at; at < text.size() && text[at] != mark; ++at) {
      if (text[at] == '\\' && at + 1 < text.size()) ++at;
      one += text[at];
    }
    strings.push_back(std::move(one));
  }
  return strings;
}

std::optional<glm::dquat> rotation_of(const double* v) {
  const glm::dvec3 axis(v[0], v[1], v[2]);
  if (v[3] == 0.0) return glm::dquat(1.0, 0.0, 0.0, 0.0);
  const double length = glm::length(axis);
  if (!(length > 1e-100) || !std::isfinite(length)) return std::nullopt;
  return glm::angleAxis(v[3], axis / length);
}

std::optional<PixelImage> image_of(std::string_view text) {
  constexpr size_t kMostTexels = 1 << 16;
  std::vector<uint32_t> numbers;
  for (size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;
       at = text.find_first_not_of(kBetween, at)) {
    const size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    const bool hex = text.substr(at).starts_with("0x") || text.substr(at).starts_with("0X");
    uint32_t number = 0;
    const auto [stop, error] =
        std::from_chars(text.data() + at + (hex ? 2 : 0), text.data() + end, number, hex ? 16 : 10);
    if (error != std::errc() || stop != text.data() + end || numbers.size() > kMostTexels + 2)
      return std::nullopt;
    numbers.push_back(number);
    at = end;
  }
  if (numbers.size() < 4 || numbers[0] > kMostTexels || numbers[1] > kMostTexels ||
      numbers[2] < 1 || numbers[2] > 4 ||
      numbers.size() - 3 != size_t(numbers[0]) * size_t(numbers[1]))
    return std::nullopt;
  return PixelImage{
      int(numbers[0]), int(numbers[1]), int(numbers[2]), {numbers.begin() + 3, numbers.end()}};
}

std::string text_of(double number) {
  return fmt::format("{}", number + 0.0);  // no -0
}

std::string text_of(const glm::dvec3& v) {
  return text_of(v.x) + " " + text_of(v.y) + " " + text_of(v.z);
}

std::string text_of(const glm::dquat& rotation) {
  const glm::dquat q = rotation.w < 0.0 ? -rotation : rotation;
  const glm::dvec3 part(q.x, q.y, q.z);
  const double sine = glm::length(part);
  if (!(sine > 0.0)) return "0 1 0 0";
  return text_of(part / sine) + " " + text_of(2.0 * std::atan2(sine, q.w));
}

std::string text_of(const std::vector<std::string>& strings) {
  std::string text;
  for (const std::string& one : strings) {
    if (!text.empty()) text += ' ';
    text += '"';
    for (const char c : one) {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
    text += '"';
  }
  return text;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '\'')
      out += "&apos;";
    else if (c == '\n' || c == '\t' || c == '\r')
      out += fmt::format("&#{};", int(c));
    else
      out += c;
  }
  return out;
}

}  // namespace palpate::x3d
