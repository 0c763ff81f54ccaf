#include "integration/files/dicom/dicom_layout.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>

#include "integration/files/frame_times.h"
#include "integration/files/raster/raster.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Slices closer than this share of the spacing lie at the same place; a scanner may write the
/// table's position anew in each frame.
constexpr double kSamePlaceShare = 0.02;
constexpr double kSamePlaceMm = 1e-3;

/// A slice is hardly thicker than this many pixels, whatever its file says.
constexpr double kThickInPixels = 4.0;

/// Gaps that differ by more than this share of the spacing are uneven: far above rounding, far
/// below a lost slice. Rounded texts are allowed one unit of their last decimal instead, but never
/// more than a quarter of the spacing: a lost slice differs by all of it.
constexpr double kUnevenShare = 0.01;
constexpr double kMostRounding = 0.25;

/// How far a slice may lie from the even stack: also small unevenness must not add up.
constexpr double kOffLineShare = 0.05;

/// Unit vectors of slices that belong together agree to the rounding of their text.
constexpr double kSameDirection = 1e-4;

/// Trigger times that span more than this are no heart beat.
constexpr double kLongestBeatMs = 2500.0;

using Group = std::vector<size_t>;
using Slices = std::vector<DicomSlice>;
using Path = std::filesystem::path;

double height_of(const DicomSlice& first, const DicomSlice& slice) {
  return glm::dot(glm::cross(first.along_row, first.along_column), slice.position_mm);
}

/// By how much positions may differ because their text is rounded, along the stack.
double rounding_mm(const Slices& slices, const Group& all) {
  double unit = slices[all.front()].position_unit_mm;
  for (const size_t s : all) unit = std::min(unit, slices[s].position_unit_mm);
  const DicomSlice& first = slices[all.front()];
  const glm::dvec3 normal = glm::abs(glm::cross(first.along_row, first.along_column));
  return unit * (normal.x + normal.y + normal.z);
}

/// "7 images of slice 2 ..., but 6 of the others".
Status check_complete(const Path& name, const Slices& slices, const std::vector<Group>& places) {
  std::map<size_t, size_t> votes;
  for (const Group& place : places) ++votes[place.size()];
  const size_t usual = std::max_element(votes.begin(), votes.end(), [](auto& a, auto& b) {
                         return a.second < b.second;
                       })->first;
  for (size_t p = 0; p < places.size(); ++p) {
    if (places[p].size() == usual) continue;
    std::set<std::string> series;
    for (const size_t s : places[p]) series.insert(slices[s].series);
    if (series.size() > 1 && places[p].size() % usual == 0 && places[p].size() > usual) {
      std::set<double> numbers;
      for (const size_t s : places[p]) numbers.insert(slices[s].series_number);
      return bad_input(name,
                       "holds {} images of slice {} (like '{}') but {} of the others: the slice "
                       "was acquired {} times, keep one of the series {}",
                       places[p].size(), p, slices[places[p].front()].file.filename().string(),
                       usual, series.size(), fmt::join(numbers, ", "));
    }
    return bad_input(name,
                     "holds {} images of slice {} (like '{}') but {} of the others: every slice "
                     "needs the same frames; complete the folder, or keep one scan in it",
                     places[p].size(), p, slices[places[p].front()].file.filename().string(),
                     usual);
  }
  return Nothing{};
}

/// Shifts beside the normal: between frames of a place, and from place to place.
Status check_straight(const Path& name, const Slices& slices, const std::vector<Group>& places,
                      double rounding) {
  const DicomSlice& first = slices[places.front().front()];
  const glm::dvec3 normal = glm::cross(first.along_row, first.along_column);
  const double most =
      0.1 * std::min(first.spacing_mm.x, first.spacing_mm.y) + std::min(rounding, 0.1);
  const auto beside = [&](const DicomSlice& slice, const DicomSlice& other) {
    const glm::dvec3 offset = slice.position_mm - other.position_mm;
    return offset - normal * glm::dot(normal, offset);
  };
  double worst = 0.0;
  for (const Group& place : places) {
    for (const size_t s : place) {
      const double apart = glm::length(beside(slices[s], slices[place.front()]));
      if (apart > most) {
        return bad_input(name,
                         "has frames of one slice that lie {:.3g} mm apart ('{}' and '{}'): they "
                         "are of two scans, or the table moved; keep one scan in the folder",
                         apart, slices[place.front()].file.filename().string(),
                         slices[s].file.filename().string());
      }
    }
    worst = std::max(worst, glm::length(beside(slices[place.front()], first)));
  }
  if (worst <= most) return Nothing{};
  // A tilted gantry shifts each slice by the same step; anything else is a patient who moved.
  const double last = double(places.size()) - 1.0;
  const glm::dvec3 step = beside(slices[places.back().front()], first) / last;
  double off_line = 0.0;
  for (size_t p = 0; p < places.size(); ++p) {
    off_line = std::max(off_line,
                        glm::length(beside(slices[places[p].front()], first) - step * double(p)));
  }
  if (off_line <= 0.1 * std::min(first.spacing_mm.x, first.spacing_mm.y)) {
    return bad_input(name,
                     "has slices that are shifted sideways by {:.3g} mm (a tilted gantry): "
                     "resample the scan to a straight grid",
                     worst);
  }
  return bad_input(name,
                   "has slices that are shifted sideways against each other by up to {:.3g} mm, "
                   "each by another amount (as between breath-holds): align them first, or "
                   "resample the scan to a straight grid",
                   worst);
}

Result<Grid> grid_of(const Path& name, const Slices& slices, const std::vector<Group>& places,
                     double rounding) {
  const DicomSlice& first = slices[places.front().front()];
  const glm::dvec3 normal = glm::cross(first.along_row, first.along_column);
  std::vector<double> heights;
  for (const Group& place : places) heights.push_back(height_of(first, slices[place.front()]));
  std::vector<double> gaps(heights.size());
  std::adjacent_difference(heights.begin(), heights.end(), gaps.begin());
  gaps.erase(gaps.begin());
  double spacing = first.thickness_mm;
  if (!gaps.empty()) {
    std::vector<double> sorted = gaps;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    const double usual = sorted[sorted.size() / 2];
    const double rounded = std::min(rounding, kMostRounding * usual);
    const double mean = (heights.back() - heights.front()) / double(gaps.size());
    const double most = std::max(kUnevenShare * usual + kSamePlaceMm, rounded);
    for (size_t g = 0; g < gaps.size(); ++g) {
      if (std::abs(gaps[g] - usual) <= most + kSamePlaceShare * usual ||
          std::abs(gaps[g] - mean) <= rounded)
        continue;
      return bad_input(name,
                       "has unevenly spaced slices ({:.4g} mm between slice {} and {}, {:.4g} mm "
                       "elsewhere): find the "
                       "missing slice, or resample the scan evenly",
                       gaps[g], g, g + 1, usual);
    }
    // The line of least squares: the rounding of the two ends counts no more than any other.
    const double middle = 0.5 * double(gaps.size());
    double steps = 0.0, moments = 0.0;
    for (size_t p = 0; p < heights.size(); ++p) {
      const double k = double(p) - middle;
      steps += k * k;
      moments += k * (heights[p] - heights.front());
    }
    spacing = moments / steps;
    for (size_t p = 0; p < heights.size(); ++p) {
      const double off = std::abs(heights[p] - heights.front() - double(p) * spacing);
      if (off <= std::max(kOffLineShare * spacing, rounded)) continue;
      return bad_input(name,
                       "has slices whose distance changes along the stack: slice {} lies {:.3g} mm "
                       "beside an even stack of {:.4g} mm; resample the scan evenly",
                       p, off, spacing);
    }
  }
  if (const Status straight = check_straight(name, slices, places, rounding); !straight)
    return straight.error();
  Placement placement;
  placement.size = {first.size.x, first.size.y, double(places.size())};
  placement.spacing_mm = {first.spacing_mm.x, first.spacing_mm.y, spacing};
  placement.origin_mm = first.position_mm;
  placement.axes = glm::dmat3(first.along_row, first.along_column, normal);
  return make_grid(name, placement);
}

// The order of the frames -------------------------------------------------------------------------

enum class Kind { kInput, kMeaning, kHabit, kLast };

/// Something that may tell the slices of a place apart.
struct OrderKey {
  std::string name;
  Kind kind = Kind::kHabit;
  /// Frame k has the same value at all places: a value that one place lacks is a missing image.
  bool is_shared = false;
  std::function<std::optional<double>(const DicomSlice&)> value;
};

enum class Tells { kNothing, kSome, kAll };

/// A key with the order that it gives.
struct KeyOrder {
  const OrderKey* key = nullptr;
  Tells tells = Tells::kNothing;
  std::vector<Group> places;  ///< sorted; where it tells all
};

KeyOrder order_by(const OrderKey& key, const Slices& slices, const std::vector<Group>& places) {
  KeyOrder found{&key, Tells::kNothing, places};
  bool has_ties = false, differs = false;
  for (Group& place : found.places) {
    for (const size_t s : place) {
      if (!key.value(slices[s])) return {&key, Tells::kNothing, {}};
    }
    const auto value = [&](size_t s) { return *key.value(slices[s]); };
    std::stable_sort(place.begin(), place.end(),
                     [&](size_t a, size_t b) { return value(a) < value(b); });
    for (size_t n = 1; n < place.size(); ++n)
      (value(place[n]) == value(place[n - 1]) ? has_ties : differs) = true;
  }
  if (!differs) return {&key, Tells::kNothing, {}};
  found.tells = has_ties ? Tells::kSome : Tells::kAll;
  return found;
}

bool is_reversed(const std::vector<Group>& a, const std::vector<Group>& b) {
  for (size_t p = 0; p < a.size(); ++p) {
    if (!std::equal(a[p].begin(), a[p].end(), b[p].rbegin())) return false;
  }
  return true;
}

/// True if b is a from another frame on: the same cycle, begun elsewhere.
bool is_rotated(const std::vector<Group>& a, const std::vector<Group>& b) {
  const size_t count = a.front().size();
  const size_t begin =
      size_t(std::find(b.front().begin(), b.front().end(), a.front().front()) - b.front().begin());
  for (size_t p = 0; p < a.size(); ++p) {
    for (size_t k = 0; k < count; ++k) {
      if (a[p][k] != b[p][(begin + k) % count]) return false;
    }
  }
  return true;
}

/// Numbers that count on in the same way at every place, in slices or in frames; any others were
/// given by chance, and their order at a place means nothing.
bool counts_evenly(const KeyOrder& order, const Slices& slices) {
  const auto& value = order.key->value;
  const Group& first = order.places.front();
  for (const Group& place : order.places) {
    for (size_t k = 1; k < place.size(); ++k) {
      const double step = *value(slices[place[k]]) - *value(slices[place[0]]);
      if (step != *value(slices[first[k]]) - *value(slices[first[0]])) return false;
    }
  }
  return true;
}

/// A value of frame k that another frame has at another place.
Status check_shared(const Path& name, const KeyOrder& order, const Slices& slices) {
  const auto value = [&](size_t s) { return *order.key->value(slices[s]); };
  const Group& first = order.places.front();
  for (size_t p = 1; p < order.places.size(); ++p) {
    const Group& place = order.places[p];
    for (size_t k = 0; k < place.size(); ++k) {
      if (value(place[k]) == value(first[k])) continue;
      const bool elsewhere = std::any_of(place.begin(), place.end(),
                                         [&](size_t s) { return value(s) == value(first[k]); });
      const bool other = std::any_of(first.begin(), first.end(),
                                     [&](size_t s) { return value(s) == value(place[k]); });
      if (!elsewhere && !other) continue;
      return bad_input(name,
                       "has an image of slice {} with the {} {:g}, but none of slice {}: every "
                       "slice needs the same frames; complete the folder",
                       elsewhere ? p : 0, order.key->name,
                       elsewhere ? value(place[k]) : value(first[k]), elsewhere ? 0 : p);
    }
  }
  return Nothing{};
}

/// Whether each series of the group has one image of each place that it has: a frame of its own.
bool are_series_frames(const Slices& slices, const std::vector<Group>& places) {
  for (const Group& place : places) {
    std::set<std::string> series;
    for (const size_t s : place) {
      if (!series.insert(slices[s].series).second) return false;
    }
  }
  return true;
}

/// Phases of one scan as series: by the numbers that differ in their names, or in those of their
/// folders.
void add_name_keys(const Slices& slices, const Group& all, const char* key_name, Kind kind,
                   const std::function<std::string(const DicomSlice&)>& text,
                   std::vector<OrderKey>& keys) {
  std::map<std::string, PhaseName> names;
  for (const size_t s : all) names.emplace(slices[s].series, phase_name(text(slices[s])));
  const PhaseName first = names.begin()->second;
  bool has_direction = false;
  for (const auto& [uid, name] : names) {
    if (name.numbers.size() != first.numbers.size() || name.rest != first.rest) return;
    has_direction = has_direction || name.direction != 0;
  }
  for (size_t n = 0; n < first.numbers.size(); ++n) {
    std::map<std::string, double> value_of;
    std::set<double> in, values;
    for (const auto& [uid, name] : names) {
      value_of[uid] = name.numbers[n];
      values.insert(name.numbers[n]);
      if (name.direction >= 0) in.insert(name.numbers[n]);
    }
    if (values.size() < 2) continue;
    // In rises to 100 %, then ex falls; the ends are said once, with either word.
    if (has_direction && *values.rbegin() <= 100.0) {
      for (auto& [uid, value] : value_of) {
        if (names[uid].direction >= 0 || (value == 0.0 && !in.count(0.0))) continue;
        value = value == 100.0 ? 100.5 : 200.0 - value;
      }
    }
    keys.push_back(
        {key_name, kind, true, [value_of](const DicomSlice& slice) -> std::optional<double> {
           return value_of.at(slice.series);
         }});
  }
}

std::vector<OrderKey> keys_of(const Slices& slices, const Group& all,
                              const std::vector<Group>& places) {
  using S = const DicomSlice&;
  std::vector<OrderKey> keys = {
      {"order in which they were named", Kind::kInput, true,
       [](S s) { return std::optional<double>(double(s.input)); }},
      {"temporal position (0020,0100)", Kind::kMeaning, true,
       [](S s) { return s.temporal_position; }},
      {"trigger time (0018,1060)", Kind::kMeaning, false, [](S s) { return s.trigger_time_ms; }},
      {"phase (0020,9241)", Kind::kMeaning, true, [](S s) { return s.phase_percent; }},
      {"phase number (2001,1008)", Kind::kMeaning, true, [](S s) { return s.phase_number; }},
      {"phase in the scan options (0018,0022)", Kind::kMeaning, true,
       [](S s) { return s.scan_percent; }},
      {"frame reference time (0054,1300)", Kind::kMeaning, false,
       [](S s) { return s.frame_reference_ms; }}};
  if (are_series_frames(slices, places)) {
    add_name_keys(
        slices, all, "number in the series' names", Kind::kMeaning,
        [](S s) { return s.series_description; }, keys);
    add_name_keys(
        slices, all, "number in the folders' names", Kind::kHabit,
        [](S s) { return s.file.parent_path().filename().string(); }, keys);
    keys.push_back({"series number (0020,0011)", Kind::kHabit, true,
                    [](S s) { return std::optional<double>(s.series_number); }});
  }
  keys.push_back({"acquisition number (0020,0012)", Kind::kHabit, false,
                  [](S s) { return s.acquisition_number; }});
  keys.push_back({"acquisition time (0008,0032)", Kind::kHabit, false,
                  [](S s) { return s.acquisition_time_s; }});
  keys.push_back(
      {"content time (0008,0033)", Kind::kLast, false, [](S s) { return s.content_time_s; }});
  keys.push_back(
      {"instance number (0020,0013)", Kind::kLast, false, [](S s) { return s.instance_number; }});
  return keys;
}

constexpr const char* kOwnFolders =
    "put every frame into a folder of its own, and name these folders in their order";

Error disagreement(const Path& name, const OrderKey& a, const OrderKey& b) {
  return bad_input(name, "has its frames in one order by their {}, in another by their {}: {}",
                   a.name, b.name, kOwnFolders);
}

/// Whether the other keys agree with the winner, or may differ from it. count: the key of the
/// instance number.
Status check_others(const Path& name, const KeyOrder& winner, const std::vector<KeyOrder>& orders,
                    const OrderKey& count, std::vector<std::string>& notes) {
  for (const KeyOrder& other : orders) {
    if (other.tells != Tells::kAll || other.places == winner.places) continue;
    const Kind mine = winner.key->kind, its = other.key->kind;
    if (mine == Kind::kInput && its == Kind::kMeaning) {
      notes.push_back(
          fmt::format("The frames are in the order in which they were named; by their {} they "
                      "would be in another.",
                      other.key->name));
    } else if (mine == Kind::kMeaning && its == Kind::kMeaning) {
      if (!is_rotated(winner.places, other.places))
        return disagreement(name, *winner.key, *other.key);
      notes.push_back(
          fmt::format("The frames begin as their {} does; by their {} the cycle begins "
                      "with another frame.",
                      winner.key->name, other.key->name));
    } else if (mine == Kind::kHabit && its == Kind::kHabit) {
      return disagreement(name, *winner.key, *other.key);
    } else if (mine >= Kind::kHabit && other.key == &count) {
      // Some scanners count instances backwards.
      if (mine == Kind::kLast || !is_reversed(winner.places, other.places))
        return disagreement(name, *winner.key, *other.key);
    }
  }
  return Nothing{};
}

/// Whether the clock contradicts the winner. Trigger times of scans that nothing triggers are the
/// maker's own clock, and positions in time may be renumbered: two witnesses against them are
/// enough.
Status check_clock(const Path& name, const KeyOrder& winner, const std::vector<KeyOrder>& orders,
                   const Slices& slices) {
  const auto named = [&](const char* start) -> const KeyOrder* {
    for (const KeyOrder& order : orders)
      if (order.tells == Tells::kAll && order.key->name.starts_with(start)) return &order;
    return nullptr;
  };
  const DicomSlice& first = slices[winner.places.front().front()];
  const DicomSlice& last = slices[winner.places.front().back()];
  const KeyOrder *clock = named("acquisition time"), *count = named("instance number");
  if (winner.key->kind != Kind::kMeaning || !clock || clock->places == winner.places ||
      first.is_gated)
    return Nothing{};
  const bool is_beat = first.trigger_time_ms && last.trigger_time_ms &&
                       *last.trigger_time_ms - *first.trigger_time_ms <= kLongestBeatMs;
  const bool is_trigger = winner.key->name.starts_with("trigger");
  const bool has_phase = first.phase_percent || first.scan_percent || is_beat;
  const bool is_position = winner.key->name.starts_with("temporal");
  if ((is_trigger && !is_beat) ||
      (is_position && !has_phase && count && count->places == clock->places))
    return disagreement(name, *winner.key, *clock->key);
  return Nothing{};
}

/// The frames' order by the first key that tells them apart, if no other contradicts it.
Result<KeyOrder> choose_order(const Path& name, const Slices& slices,
                              const std::vector<OrderKey>& keys, const std::vector<Group>& places,
                              std::vector<std::string>& notes) {
  std::vector<KeyOrder> orders;
  for (const OrderKey& key : keys) {
    KeyOrder order = order_by(key, slices, places);
    const bool is_count = &key == &keys.back();
    if (order.tells == Tells::kAll && is_count && !counts_evenly(order, slices)) continue;
    if (order.tells != Tells::kNothing) orders.push_back(std::move(order));
  }
  const auto winner = std::find_if(orders.begin(), orders.end(), [](const KeyOrder& order) {
    return order.tells == Tells::kAll;
  });
  // What means time or phase, but tells only some of the images apart: a product of two dimensions,
  // such as phases and repetitions, or the same phase twice.
  const auto some = std::find_if(orders.begin(), orders.end(), [](const KeyOrder& order) {
    return order.tells == Tells::kSome && order.key->kind == Kind::kMeaning;
  });
  if (some != orders.end() && (winner == orders.end() || winner->key->kind > Kind::kMeaning)) {
    return bad_input(name,
                     "holds {} images of each slice, and their {} tells only some of them apart: "
                     "there are several of one phase; {}",
                     places.front().size(), some->key->name, kOwnFolders);
  }
  if (winner == orders.end()) {
    return bad_input(
        name,
        "holds {} images of each slice, but no temporal position, trigger time, phase, series, "
        "acquisition time or instance number tells them apart: {}",
        places.front().size(), kOwnFolders);
  }
  if (winner->key->is_shared) {
    if (const Status shared = check_shared(name, *winner, slices); !shared) return shared.error();
  }
  if (const Status agree = check_others(name, *winner, orders, keys.back(), notes); !agree)
    return agree.error();
  if (const Status clock = check_clock(name, *winner, orders, slices); !clock) return clock.error();
  if (winner->key->kind == Kind::kLast)
    notes.push_back(fmt::format("Nothing but the {} orders the frames.", winner->key->name));
  return *winner;
}

/// Mean trigger time of each frame, or its frame reference time, or the temporal resolution times
/// the frame number, or the time of the acquisition if nothing steered that. Gated scans are
/// acquired in another order than that of the motion. The last counts from the first frame on.
void find_times(const Slices& slices, const OrderKey& key, DicomLayout& layout) {
  layout.times_s = counted_times(layout.frames.size());
  if (layout.frames.size() < 2) return;
  const DicomSlice& first = slices[layout.frames[0][0]];
  const auto use = [&](const std::function<std::optional<double>(const DicomSlice&)>& time_s) {
    std::vector<double> times;
    for (const Group& frame : layout.frames) {
      double sum_s = 0.0;
      for (const size_t s : frame) {
        const auto time = time_s(slices[s]);
        if (!time) return;
        sum_s += *time;
      }
      times.push_back(sum_s / double(frame.size()));
    }
    // Times that do not rise do not belong to the phase by which the frames were sorted.
    if (layout.times_known || !is_rising(times)) return;
    layout.times_s = std::move(times);
    layout.times_known = true;
  };
  const auto ms = [](std::optional<double> time) {
    return time ? std::optional<double>(1e-3 * *time) : std::nullopt;
  };
  if (key.name.starts_with("frame reference"))
    use([&](const DicomSlice& s) { return ms(s.frame_reference_ms); });
  const bool is_clock = key.name.starts_with("acquisition time");
  if (!is_clock) {
    use([&](const DicomSlice& s) { return ms(s.trigger_time_ms); });
    use([&](const DicomSlice& s) { return ms(s.frame_reference_ms); });
    if (first.temporal_resolution_ms && first.temporal_position &&
        *first.temporal_resolution_ms > 0.0 && !layout.times_known) {
      for (size_t k = 0; k < layout.frames.size(); ++k)
        layout.times_s[k] = 1e-3 * *first.temporal_resolution_ms * double(k);
      layout.times_known = true;
    }
  }
  const bool is_phase = first.is_gated || first.phase_percent || first.scan_percent ||
                        first.phase_number || key.name.starts_with("number in");
  if (is_phase && !is_clock) return;
  const auto since_first = [](std::optional<double> time, std::optional<double> start) {
    return time && start ? std::optional<double>(*time - *start) : std::nullopt;
  };
  use([&](const DicomSlice& s) {
    return since_first(s.acquisition_time_s, first.acquisition_time_s);
  });
  if (key.name.starts_with("content time"))
    use([&](const DicomSlice& s) { return since_first(s.content_time_s, first.content_time_s); });
}

/// The slices of the last frame where a scan was stopped before it was complete; empty where none
/// is, or where what is missing may be something else. Heart and breath give slices another number
/// of phases, so nothing is left out of what they steer.
Group stopped_frame(const Slices& slices, const std::vector<Group>& places) {
  for (const auto number : {&DicomSlice::temporal_position, &DicomSlice::acquisition_number}) {
    std::map<double, Group> frames;
    bool tells = true;
    for (const Group& place : places) {
      std::set<double> seen;
      for (const size_t s : place) {
        const auto& value = slices[s].*number;
        tells = tells && value && !slices[s].is_gated && !slices[s].trigger_time_ms &&
                seen.insert(*value).second;
        if (tells) frames[*value].push_back(s);
      }
    }
    if (!tells || frames.size() < 3) continue;
    const bool rest_is_whole =
        std::all_of(frames.begin(), std::prev(frames.end()),
                    [&](const auto& frame) { return frame.second.size() == places.size(); });
    if (rest_is_whole && frames.rbegin()->second.size() < places.size())
      return frames.rbegin()->second;
  }
  return {};
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_digit_at(const std::string& text, size_t at) {
  return at < text.size() && text[at] >= '0' && text[at] <= '9';
}

/// True for numbers that name a contrast, an energy or a thickness, not a phase: "T2", "echo 2",
/// "b1000", "70 keV", "5 mm". `word` stands before the number, which lies at begin .. end.
bool names_a_contrast(const std::string& word, const std::string& digits, const std::string& text,
                      size_t begin, size_t end) {
  const bool is_joined = begin > 0 && is_letter(text[begin - 1]);
  if (word == "t" && is_joined && (digits == "1" || digits == "2")) return true;
  for (const char* before : {"te", "ti", "tr", "b", "echo", "echoes", "mono", "kv", "venc"})
    if (word == before) return true;
  size_t at = end;
  while (at < text.size() && text[at] == ' ') ++at;
  size_t stop = at;
  while (stop < text.size() && is_letter(text[stop])) ++stop;
  const std::string unit = text.substr(at, stop - at);
  for (const char* after : {"mm", "cm", "kev", "kv", "kvp", "mas"})
    if (unit == after) return true;
  return false;
}

/// 1 for words of breathing in, -1 out, 0 for any other.
int breath_direction(const std::string& word) {
  for (const char* in : {"in", "inh", "insp", "inhale", "inspiration"})
    if (word == in) return 1;
  for (const char* out : {"ex", "exh", "exp", "exhale", "expiration"})
    if (word == out) return -1;
  return 0;
}

}  // namespace

const char* shape_difference(const DicomSlice& a, const DicomSlice& b) {
  if (a.size != b.size || a.picture_size != b.picture_size) return "size";
  if (glm::length(a.spacing_mm - b.spacing_mm) > kUnevenShare * a.spacing_mm.x)
    return "pixel spacing";
  if (glm::length(a.along_row - b.along_row) > kSameDirection ||
      glm::length(a.along_column - b.along_column) > kSameDirection)
    return "direction";
  return nullptr;
}

std::vector<Group> places_of(const Slices& slices, Group group) {
  if (group.empty()) return {};
  const DicomSlice first = slices[group.front()];
  const auto height = [&](size_t s) { return height_of(first, slices[s]); };
  std::stable_sort(group.begin(), group.end(),
                   [&](size_t a, size_t b) { return height(a) < height(b); });
  // The usual gap between places; gaps between frames of one place are far smaller than a slice.
  const double least =
      std::max(kSamePlaceMm,
               kSamePlaceShare * std::min(first.thickness_mm, kThickInPixels * first.spacing_mm.x));
  std::vector<double> gaps;
  for (size_t n = 1; n < group.size(); ++n) {
    const double gap = height(group[n]) - height(group[n - 1]);
    if (gap > least) gaps.push_back(gap);
  }
  double same = least;
  if (!gaps.empty()) {
    std::nth_element(gaps.begin(), gaps.begin() + gaps.size() / 2, gaps.end());
    const double usual = gaps[gaps.size() / 2];
    same = std::min(std::max({kSamePlaceShare * usual, rounding_mm(slices, group), kSamePlaceMm}),
                    kMostRounding * usual);
  }
  std::vector<Group> places;
  for (const size_t s : group) {
    if (places.empty() || height(s) - height(places.back().front()) > same) places.emplace_back();
    places.back().push_back(s);
  }
  return places;
}

PhaseName phase_name(const std::string& description) {
  PhaseName name;
  const std::string text = lowered(description);
  const bool has_percent = text.find('%') != std::string::npos;
  std::string word;  // the last one before
  for (size_t at = 0; at < text.size();) {
    const size_t begin = at;
    const bool is_negative =
        text[at] == '-' && is_digit_at(text, at + 1) && (at == 0 || text[at - 1] == ' ');
    if (is_digit_at(text, at) || is_negative) {
      ++at;
      while (is_digit_at(text, at) ||
             (at < text.size() && text[at] == '.' && is_digit_at(text, at + 1)))
        ++at;
      const std::string digits = text.substr(begin, at - begin);
      const auto number = to_number(digits);
      const bool is_phase = number && !names_a_contrast(word, digits, text, begin, at);
      if (is_phase) name.numbers.push_back(*number);
      name.rest += is_phase ? "#" : digits;
      word.clear();
    } else if (is_letter(text[at])) {
      while (at < text.size() && is_letter(text[at])) ++at;
      word = text.substr(begin, at - begin);
      const int direction = has_percent ? breath_direction(word) : 0;
      if (direction == 0) name.rest += word;
      if (direction != 0) name.direction = direction;
      if (direction != 0 && at < text.size() && text[at] == '.') ++at;
    } else {
      // White space does not count: "50 %" and "50%" are one name.
      if (text[at] != ' ') name.rest += text[at];
      ++at;
    }
  }
  return name;
}

Result<DicomLayout> arrange_slices(const Path& name, const Slices& slices, const Group& all) {
  std::vector<Group> places = places_of(slices, all);
  if (const Group broken_off = stopped_frame(slices, places); !broken_off.empty()) {
    Group whole = all;
    std::erase_if(whole, [&](size_t s) {
      return std::find(broken_off.begin(), broken_off.end(), s) != broken_off.end();
    });
    auto layout = arrange_slices(name, slices, whole);
    if (layout) {
      layout->notes.push_back(
          fmt::format("The last frame is left out: it has {} of {} slices, the scan was stopped.",
                      broken_off.size(), places.size()));
    }
    return layout;
  }
  const double rounding = rounding_mm(slices, all);
  if (const Status complete = check_complete(name, slices, places); !complete)
    return complete.error();
  auto grid = grid_of(name, slices, places, rounding);
  if (!grid) return grid.error();
  DicomLayout layout;
  const std::vector<OrderKey> keys = keys_of(slices, all, places);
  OrderKey none;
  const OrderKey* told = &none;
  if (places.front().size() > 1) {
    auto order = choose_order(name, slices, keys, places, layout.notes);
    if (!order) return order.error();
    places = std::move(order->places);
    told = order->key;
    layout.ordered_by = told->name;
  }
  layout.grid = *grid;
  layout.frames.resize(places.front().size());
  for (const Group& place : places) {
    for (size_t k = 0; k < place.size(); ++k) layout.frames[k].push_back(place[k]);
  }
  find_times(slices, *told, layout);
  return layout;
}

}  // namespace palpate::files
