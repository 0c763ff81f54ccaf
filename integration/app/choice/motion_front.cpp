#include "integration/app/choice/motion_front.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include <fmt/format.h>

namespace palpate::app {
namespace {

Error bad_measures(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

/// Two figures are enough for a choice.
std::string seconds_text(double seconds) {
  return seconds < 0.01 ? fmt::format("{:.2g} ms", 1e3 * seconds)
                        : fmt::format("{:.2g} s", seconds);
}

double scaled_seconds(const MotionFront& front, const FrontPoint& point, size_t voxels) {
  return point.seconds * double(voxels) / double(front.voxels);
}

Result<Choice> chosen(const MotionFront& front, const FrontPoint& point, size_t voxels,
                      double voxel_mm, const std::string& wish) {
  auto setting = motion_setting(point.setting);
  if (!setting) {
    return bad_measures(
        fmt::format("The measured front names a setting '{}' that this version does not "
                    "have: run 'palpate chart motion' again.",
                    point.setting));
  }
  Choice choice{std::move(*setting), scaled_seconds(front, point, voxels),
                point.error_voxels * voxel_mm, ""};
  choice.why = fmt::format(
      "{} for {}: about {} a pair and {:.2g} mm of error, from {} measured on {}", point.setting,
      wish, seconds_text(choice.expected_s), choice.expected_error_mm,
      front.points.size() == 1 ? "one setting" : fmt::format("{} settings", front.points.size()),
      front.device);
  return choice;
}

}  // namespace

std::string front_text(const MotionFront& front) {
  nlohmann::ordered_json json = {{"device", front.device},
                                 {"version", front.version},
                                 {"pair", front.pair},
                                 {"voxels", front.voxels},
                                 {"points", nlohmann::ordered_json::array()}};
  for (const FrontPoint& point : front.points) {
    json["points"].push_back({{"setting", point.setting},
                              {"seconds", point.seconds},
                              {"error_voxels", point.error_voxels}});
  }
  return json.dump(2) + "\n";
}

Result<MotionFront> parse_front(const std::string& text) {
  const Error broken =
      bad_measures("The measured front can not be read: run 'palpate chart motion' again.");
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return broken;
  MotionFront front;
  try {
    front.device = json.at("device").get<std::string>();
    front.version = json.at("version").get<std::string>();
    front.pair = json.at("pair").get<std::string>();
    front.voxels = json.at("voxels").get<size_t>();
    for (const auto& point : json.at("points"))
      front.points.push_back({point.at("setting").get<std::string>(),
                              point.at("seconds").get<double>(),
                              point.at("error_voxels").get<double>()});
  } catch (const nlohmann::json::exception&) {
    return broken;
  }
  if (front.voxels == 0 || front.points.empty()) return broken;
  for (const FrontPoint& point : front.points)
    if (!(point.seconds > 0.0) || !(point.error_voxels >= 0.0)) return broken;
  return front;
}

Result<Choice> choose_within(const MotionFront& front, double seconds, size_t voxels,
                             double voxel_mm) {
  const FrontPoint* best = nullptr;
  const FrontPoint* fastest = nullptr;
  for (const FrontPoint& point : front.points) {
    if (!fastest || point.seconds < fastest->seconds) fastest = &point;
    if (scaled_seconds(front, point, voxels) > seconds) continue;
    if (!best || point.error_voxels < best->error_voxels) best = &point;
  }
  if (!fastest)
    return bad_measures("The measured front is empty: run 'palpate chart motion' again.");
  if (!best) {
    return bad_measures(
        fmt::format("No setting is expected to take {} or less for {:.2g} million voxels on "
                    "this machine: the fastest, {}, takes about {}. Give more time, or "
                    "fewer voxels.",
                    seconds_text(seconds), 1e-6 * double(voxels), fastest->setting,
                    seconds_text(scaled_seconds(front, *fastest, voxels))));
  }
  return chosen(front, *best, voxels, voxel_mm, "at most " + seconds_text(seconds));
}

Result<std::vector<Choice>> choose_by_error(const MotionFront& front, double error_mm,
                                            size_t voxels, double voxel_mm) {
  const FrontPoint* best = nullptr;
  std::vector<FrontPoint> good;
  for (const FrontPoint& point : front.points) {
    if (!best || point.error_voxels < best->error_voxels) best = &point;
    if (point.error_voxels * voxel_mm <= error_mm) good.push_back(point);
  }
  if (!best) return bad_measures("The measured front is empty: run 'palpate chart motion' again.");
  if (good.empty()) {
    return bad_measures(
        fmt::format("No setting is expected to come within {:.2g} mm for voxels of {:.3g} "
                    "mm: the most accurate, {}, is wrong by about {:.2g} mm. Allow more "
                    "error, or use finer data.",
                    error_mm, voxel_mm, best->setting, best->error_voxels * voxel_mm));
  }
  std::sort(good.begin(), good.end(),
            [](const FrontPoint& a, const FrontPoint& b) { return a.seconds < b.seconds; });
  const std::string wish = fmt::format("at most {:.2g} mm of error", error_mm);
  std::vector<Choice> choices;
  for (const FrontPoint& point : good) {
    auto choice = chosen(front, point, voxels, voxel_mm, wish);
    if (!choice) return choice.error();
    if (choices.empty() || choice->expected_error_mm < choices.back().expected_error_mm)
      choices.push_back(std::move(*choice));
  }
  return choices;
}

}  // namespace palpate::app
