#include "integration/files/dicom_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "integration/files/frame_times.h"
#include "integration/files/raster.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Slices closer than this lie at the same place; positions are written with at least three
/// decimals.
constexpr double kSamePlaceMm = 1e-3;

/// Gaps that differ by more than this share of the spacing are uneven: far above rounding, far
/// below a lost slice.
constexpr double kUnevenShare = 0.01;

/// Unit vectors of slices that belong together agree to the rounding of their text.
constexpr double kSameDirection = 1e-4;

using Group = std::vector<size_t>;
using SortKey = std::function<std::optional<double>(const DicomSlice&)>;

/// "Chest T=30%" -> 30.
std::optional<double> percent_in(const std::string& description) {
  const size_t end = description.find('%');
  if (end == std::string::npos) return std::nullopt;
  size_t begin = std::min(description.find_last_not_of(' ', end == 0 ? 0 : end - 1) + 1, end);
  const size_t stop = begin;
  while (begin > 0 && (std::isdigit(static_cast<unsigned char>(description[begin - 1])) ||
                       description[begin - 1] == '.'))
    --begin;
  return to_number(std::string_view(description).substr(begin, stop - begin));
}

/// Phases of one scan in the order of their time: by the percentage in the description where all
/// have one, else by series number.
std::map<std::string, double> rank_series(const std::vector<DicomSlice>& slices, const Group& all) {
  struct RankedSeries {
    double order;
    std::string uid;
  };
  std::map<std::string, const DicomSlice*> one_of;
  for (const size_t s : all) one_of[slices[s].series] = &slices[s];
  const bool all_percent = std::all_of(one_of.begin(), one_of.end(), [](const auto& entry) {
    return percent_in(entry.second->series_description).has_value();
  });
  std::vector<RankedSeries> entries;
  for (const auto& [uid, slice] : one_of) {
    entries.push_back(
        {all_percent ? *percent_in(slice->series_description) : slice->series_number, uid});
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const RankedSeries& a, const RankedSeries& b) { return a.order < b.order; });
  std::map<std::string, double> ranks;
  for (size_t r = 0; r < entries.size(); ++r) ranks[entries[r].uid] = double(r);
  return ranks;
}

Status check_same_shape(const std::vector<DicomSlice>& slices, const Group& all) {
  const DicomSlice& first = slices[all.front()];
  for (const size_t s : all) {
    const DicomSlice& slice = slices[s];
    const char* what = nullptr;
    if (slice.size != first.size) what = "size";
    if (glm::length(slice.spacing_mm - first.spacing_mm) > kUnevenShare * first.spacing_mm.x)
      what = "pixel spacing";
    if (glm::length(slice.along_row - first.along_row) > kSameDirection ||
        glm::length(slice.along_column - first.along_column) > kSameDirection) {
      what = "direction";
    }
    if (what != nullptr) {
      return bad_input(slice.file,
                       "has another {} than '{}': keep only the slices of one scan in the folder",
                       what, first.file.string());
    }
  }
  return Nothing{};
}

/// Slices at the same place, places in the order of the normal.
std::vector<Group> places_of(const std::vector<DicomSlice>& slices, Group all) {
  const DicomSlice& first = slices[all.front()];
  const glm::dvec3 normal = glm::cross(first.along_row, first.along_column);
  const auto height = [&](size_t s) { return glm::dot(normal, slices[s].position_mm); };
  std::stable_sort(all.begin(), all.end(),
                   [&](size_t a, size_t b) { return height(a) < height(b); });
  std::vector<Group> places;
  for (const size_t s : all) {
    if (places.empty() || height(s) - height(places.back().front()) > kSamePlaceMm)
      places.emplace_back();
    places.back().push_back(s);
  }
  return places;
}

Status check_complete(const std::filesystem::path& name, const std::vector<DicomSlice>& slices,
                      const std::vector<Group>& places) {
  std::map<size_t, size_t> votes;
  for (const Group& place : places) ++votes[place.size()];
  const size_t usual = std::max_element(votes.begin(), votes.end(), [](auto& a, auto& b) {
                         return a.second < b.second;
                       })->first;
  for (size_t p = 0; p < places.size(); ++p) {
    if (places[p].size() == usual) continue;
    return bad_input(name,
                     "holds {} images of slice {} (like '{}') but {} of others: complete the "
                     "folder, or keep one scan in it",
                     places[p].size(), p, slices[places[p].front()].file.filename().string(),
                     usual);
  }
  return Nothing{};
}

Result<Grid> grid_of(const std::filesystem::path& name, const std::vector<DicomSlice>& slices,
                     const std::vector<Group>& places) {
  const DicomSlice& first = slices[places.front().front()];
  const glm::dvec3 normal = glm::cross(first.along_row, first.along_column);
  std::vector<double> heights;
  for (const Group& place : places)
    heights.push_back(glm::dot(normal, slices[place.front()].position_mm));
  std::vector<double> gaps(heights.size());
  std::adjacent_difference(heights.begin(), heights.end(), gaps.begin());
  gaps.erase(gaps.begin());
  double spacing = first.thickness_mm;
  if (!gaps.empty()) {
    std::vector<double> sorted = gaps;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    const double usual = sorted[sorted.size() / 2];
    for (size_t g = 0; g < gaps.size(); ++g) {
      if (std::abs(gaps[g] - usual) <= kUnevenShare * usual + kSamePlaceMm) continue;
      return bad_input(name,
                       "has unevenly spaced slices ({:.4g} mm between slice {} and {}, {:.4g} mm "
                       "elsewhere): find the "
                       "missing slice, or resample the scan evenly",
                       gaps[g], g, g + 1, usual);
    }
    spacing = (heights.back() - heights.front()) / double(gaps.size());
  }
  for (size_t p = 0; p < places.size(); ++p) {
    const glm::dvec3 offset = slices[places[p].front()].position_mm - first.position_mm;
    const double sideways = glm::length(offset - normal * glm::dot(normal, offset));
    if (sideways > 0.1 * std::min(first.spacing_mm.x, first.spacing_mm.y)) {
      return bad_input(name,
                       "has slices that are shifted sideways by {:.3g} mm (a tilted gantry): "
                       "resample the scan to a straight grid",
                       sideways);
    }
  }
  Placement placement;
  placement.size = {first.size.x, first.size.y, double(places.size())};
  placement.spacing_mm = {first.spacing_mm.x, first.spacing_mm.y, spacing};
  placement.origin_mm = first.position_mm;
  placement.axes = glm::dmat3(first.along_row, first.along_column, normal);
  return make_grid(name, placement);
}

/// Sorts every place by the key; false if the key is missing or equal for two slices.
bool sort_by(const SortKey& key, const std::vector<DicomSlice>& slices,
             std::vector<Group>& places) {
  for (Group& place : places) {
    for (const size_t s : place) {
      if (!key(slices[s])) return false;
    }
    std::stable_sort(place.begin(), place.end(),
                     [&](size_t a, size_t b) { return *key(slices[a]) < *key(slices[b]); });
    for (size_t n = 1; n < place.size(); ++n) {
      if (*key(slices[place[n]]) == *key(slices[place[n - 1]])) return false;
    }
  }
  return true;
}

/// What distinguishes the slices of one place, in the order in which it is tried.
enum class SliceKey {
  kInput,
  kTemporalPosition,
  kTriggerTime,
  kPhase,
  kSeries,
  kAcquisition,
  kReferenceTime,
  kAcquisitionTime
};

/// Mean trigger time of each frame, or the temporal resolution times the frame number. The time of
/// the acquisition is used only where nothing else distinguishes frames, since gated scans are
/// acquired in another order than that of the motion. It counts from the first frame on.
void find_times(const std::vector<DicomSlice>& slices, SliceKey told, DicomLayout& layout) {
  layout.times_s = counted_times(layout.frames.size());
  std::vector<double> times;
  for (size_t k = 0; k < layout.frames.size(); ++k) {
    double sum_s = 0.0;
    for (const size_t s : layout.frames[k]) {
      const DicomSlice &slice = slices[s], &first = slices[layout.frames[0][0]];
      if (told == SliceKey::kAcquisitionTime) {
        sum_s += *slice.acquisition_time_s - *first.acquisition_time_s;
      } else if (told == SliceKey::kReferenceTime) {
        sum_s += 1e-3 * *slice.frame_reference_ms;
      } else if (slice.trigger_time_ms) {
        sum_s += 1e-3 * *slice.trigger_time_ms;
      } else if (slice.temporal_resolution_ms && slice.temporal_position) {
        sum_s += 1e-3 * *slice.temporal_resolution_ms * double(k);
      } else {
        return;
      }
    }
    times.push_back(sum_s / double(layout.frames[k].size()));
  }
  // Trigger times that do not rise do not belong to the phase by which the frames were sorted.
  if (times.size() < 2 || !is_rising(times)) return;
  layout.times_s = std::move(times);
  layout.times_known = true;
}

Result<DicomLayout> arrange_group(const std::filesystem::path& name,
                                  const std::vector<DicomSlice>& slices, const Group& all) {
  if (const Status same = check_same_shape(slices, all); !same) return same.error();
  std::vector<Group> places = places_of(slices, all);
  if (const Status complete = check_complete(name, slices, places); !complete)
    return complete.error();
  auto grid = grid_of(name, slices, places);
  if (!grid) return grid.error();
  const auto ranks = rank_series(slices, all);
  const std::array<SortKey, 8> keys = {
      [](const DicomSlice& s) { return std::optional<double>(double(s.input)); },
      [](const DicomSlice& s) { return s.temporal_position; },
      [](const DicomSlice& s) { return s.trigger_time_ms; },
      [](const DicomSlice& s) { return s.phase_percent; },
      [&](const DicomSlice& s) { return std::optional<double>(ranks.at(s.series)); },
      [](const DicomSlice& s) { return s.acquisition_number; },
      [](const DicomSlice& s) { return s.frame_reference_ms; },
      [](const DicomSlice& s) { return s.acquisition_time_s; }};
  const auto key = std::find_if(keys.begin(), keys.end(),
                                [&](const SortKey& k) { return sort_by(k, slices, places); });
  if (key == keys.end()) {
    return bad_input(
        name,
        "holds {} images of each slice, but no temporal position, trigger time, phase, series or "
        "acquisition time tells them apart: put every frame into a folder of its own and name "
        "these "
        "folders",
        places.front().size());
  }
  DicomLayout layout;
  layout.grid = *grid;
  layout.frames.resize(places.front().size());
  for (const Group& place : places) {
    for (size_t k = 0; k < place.size(); ++k) layout.frames[k].push_back(place[k]);
  }
  find_times(slices, SliceKey(key - keys.begin()), layout);
  return layout;
}

}  // namespace

Result<DicomLayout> arrange_slices(const std::filesystem::path& name,
                                   const std::vector<DicomSlice>& slices) {
  if (slices.empty()) return bad_input(name, "holds no DICOM slices: name the folder of the scan");
  Group all(slices.size());
  std::iota(all.begin(), all.end(), size_t{0});
  auto together = arrange_group(name, slices, all);
  if (together) return together;
  // A localiser or a second scan may lie beside the sequence: find the only series that is a
  // sequence on its own.
  std::map<std::string, Group> by_series;
  for (const size_t s : all) by_series[slices[s].series].push_back(s);
  std::vector<DicomLayout> sequences;
  for (const auto& [uid, group] : by_series) {
    auto alone = arrange_group(name, slices, group);
    if (alone && alone->frames.size() > 1) sequences.push_back(std::move(*alone));
  }
  if (sequences.size() > 1) {
    return bad_input(name,
                     "holds {} sequences: name the folder of one of them, or move the others away",
                     sequences.size());
  }
  if (sequences.empty()) return together;
  return std::move(sequences.front());
}

}  // namespace palpate::files
