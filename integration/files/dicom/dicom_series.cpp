#include "integration/files/dicom/dicom_series.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "integration/files/dicom/dicom_kind.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

using Group = std::vector<size_t>;
using Slices = std::vector<DicomSlice>;
using Path = std::filesystem::path;

/// Of the choices, as many are named as a person reads.
constexpr size_t kMostNamed = 8;
/// Fewer slices are a localiser or a single view where a whole stack lies beside them.
constexpr size_t kStack = 3;

bool have_same_shape(const DicomSlice& a, const DicomSlice& b) {
  return shape_difference(a, b) == nullptr;
}

/// Slices that could belong together by their owner, shape and name.
std::vector<Group> sets_of(const Slices& slices, const Group& all) {
  struct SliceSet {
    std::string owner, name;
    Group slices;
  };
  std::vector<SliceSet> sets;
  std::map<std::string, std::string> name_of;  // of each series
  for (const size_t s : all) {
    const DicomSlice& slice = slices[s];
    auto [known, is_new] = name_of.emplace(slice.series, std::string());
    if (is_new) known->second = phase_name(slice.series_description).rest;
    const auto found = std::find_if(sets.begin(), sets.end(), [&](const SliceSet& set) {
      return set.owner == slice.owner && set.name == known->second &&
             have_same_shape(slices[set.slices.front()], slice);
    });
    if (found == sets.end())
      sets.push_back({slice.owner, known->second, {s}});
    else
      found->slices.push_back(s);
  }
  std::vector<Group> groups;
  for (SliceSet& set : sets) groups.push_back(std::move(set.slices));
  return groups;
}

/// The tags of the kind in which images of one place differ.
std::vector<KindTag> differing_tags(const Slices& slices, const Group& set) {
  std::vector<KindTag> tags;
  const std::vector<Group> places = places_of(slices, set);
  for (size_t tag = 0; tag < kKindTags; ++tag) {
    size_t most = 0, images = 0;
    for (const Group& place : places) {
      std::set<std::string> values;
      for (const size_t s : place) values.insert(slices[s].kind[tag]);
      if (values.size() > most) images = place.size();
      most = std::max(most, values.size());
    }
    // Some software counts on in the name of the sequence from image to image.
    const bool is_counter = KindTag(tag) == KindTag::kSequenceName && most == images && most > 3;
    if (most > 1 && !is_counter) tags.push_back(KindTag(tag));
  }
  return tags;
}

/// "echo time 4.9", or the value alone where it names itself.
std::string kind_text(KindTag tag, const std::string& value) {
  std::string shown = value.empty() ? "none" : value;
  std::replace(shown.begin(), shown.end(), '\\', ' ');
  if (tag == KindTag::kImageType || tag == KindTag::kOriginality ||
      tag == KindTag::kComplexComponent)
    return shown;
  const std::string name = name_of(tag);
  return name.substr(0, name.find(" (")) + " " + shown;
}

/// "4 'cine SAX'", or "4 to 9 'Thorax 0%' to 'Thorax 90%'" of several series.
std::string series_label(const Slices& slices, const Group& group) {
  std::set<double> numbers;
  std::vector<std::string> names;
  for (const size_t s : group) {
    numbers.insert(slices[s].series_number);
    names.push_back(slices[s].series_description);
  }
  const auto [first, last] = std::minmax_element(names.begin(), names.end(), natural_less);
  std::string label = fmt::format("{:g}", *numbers.begin());
  if (numbers.size() > 1) label += fmt::format(" to {:g}", *numbers.rbegin());
  if (!last->empty()) label += fmt::format(" '{}'", *first);
  if (*first != *last) label += fmt::format(" to '{}'", *last);
  return label;
}

std::map<std::string, Group> by_series(const Slices& slices, const Group& group) {
  std::map<std::string, Group> series;
  for (const size_t s : group) series[slices[s].series].push_back(s);
  return series;
}

/// True if the names of series differ in a number.
bool have_phases(const Slices& slices, const std::map<std::string, Group>& series) {
  std::set<std::vector<double>> numbers;
  for (const auto& [uid, group] : series)
    numbers.insert(phase_name(slices[group.front()].series_description).numbers);
  return numbers.size() > 1;
}

/// The images of one kind: all series together, or each alone.
void add_images(const Path& name, const Slices& slices, const Group& group,
                const std::string& suffix, const std::string& differs_in,
                std::vector<DicomImage>& images) {
  const auto add = [&](const Group& part, Result<DicomLayout> layout) {
    images.push_back({series_label(slices, part) + suffix, part, differs_in, std::move(layout)});
  };
  const auto series = by_series(slices, group);
  bool are_frames = true, are_single_slices = true;
  for (const auto& [uid, part] : series) {
    const auto places = places_of(slices, part);
    are_single_slices = are_single_slices && places.size() == 1;
    for (const Group& place : places) are_frames = are_frames && place.size() == 1;
  }
  const auto places = places_of(slices, group);
  bool is_shared = false;  // a place in several series
  for (const Group& place : places) is_shared = is_shared || by_series(slices, place).size() > 1;
  const bool is_stack = are_single_slices && places.size() > 1;
  // Single pictures of one name are localisers, or the same view taken again.
  const bool are_pictures = are_frames && places.size() < kStack && !have_phases(slices, series);
  if (series.size() > 1 && is_shared && (are_pictures || (!are_frames && !is_stack))) {
    for (const auto& [uid, part] : series) add(part, arrange_slices(name, slices, part));
    return;
  }
  auto layout = arrange_slices(name, slices, group);
  if (layout && series.size() > 1 && !are_frames && is_shared) {
    layout = bad_input(name,
                       "holds each slice in several series ({}), which are several scans: name the "
                       "series of one",
                       series_label(slices, group));
  } else if (layout && layout->frames.size() > 1 && are_frames && series.size() > 1) {
    layout->notes.push_back(fmt::format("Its {} frames are the series {}, ordered by the {}.",
                                        layout->frames.size(), series_label(slices, group),
                                        layout->ordered_by));
  }
  add(group, std::move(layout));
}

/// Single slices in motion with different names (base, middle, apex) are one stack if they fit.
void join_single_slices(const Path& name, const Slices& slices, std::vector<DicomImage>& images) {
  const auto is_single = [&](const DicomImage& image) {
    return image.layout && image.layout->frames.size() > 1 &&
           image.layout->frames.front().size() == 1;
  };
  for (size_t first = 0; first < images.size(); ++first) {
    if (!is_single(images[first])) continue;
    const DicomSlice& slice = slices[images[first].slices.front()];
    Group together;
    std::vector<size_t> members;
    for (size_t n = first; n < images.size(); ++n) {
      const DicomSlice& other = slices[images[n].slices.front()];
      if (!is_single(images[n]) || other.owner != slice.owner || !have_same_shape(other, slice) ||
          other.kind[size_t(KindTag::kImageType)] != slice.kind[size_t(KindTag::kImageType)])
        continue;
      together.insert(together.end(), images[n].slices.begin(), images[n].slices.end());
      members.push_back(n);
    }
    if (members.size() < kStack || places_of(slices, together).size() != members.size()) continue;
    auto layout = arrange_slices(name, slices, together);
    if (!layout) continue;
    layout->notes.push_back(fmt::format("Its {} slices are the series {}.", members.size(),
                                        series_label(slices, together)));
    images[first] = {series_label(slices, together), together, "", std::move(layout)};
    for (size_t n = members.size(); n-- > 1;)
      images.erase(images.begin() + std::ptrdiff_t(members[n]));
  }
}

std::vector<DicomImage> images_among(const Path& name, const Slices& slices, const Group& all) {
  std::vector<DicomImage> images;
  for (const Group& set : sets_of(slices, all)) {
    const std::vector<KindTag> differing = differing_tags(slices, set);
    std::string differs_in;
    for (const KindTag tag : differing) {
      const std::string tag_name = name_of(tag);
      if (differs_in.find(tag_name) == std::string::npos)
        differs_in += (differs_in.empty() ? "" : ", ") + tag_name;
    }
    std::map<std::vector<std::string>, Group> kinds;
    for (const size_t s : set) {
      std::vector<std::string> values;
      for (const KindTag tag : differing) values.push_back(slices[s].kind[size_t(tag)]);
      kinds[values].push_back(s);
    }
    for (const auto& [values, group] : kinds) {
      std::string suffix;
      for (size_t n = 0; n < values.size(); ++n)
        suffix += ", " + kind_text(differing[n], values[n]);
      add_images(name, slices, group, suffix, differs_in, images);
    }
  }
  join_single_slices(name, slices, images);
  std::stable_sort(images.begin(), images.end(), [](const DicomImage& a, const DicomImage& b) {
    return natural_less(a.label, b.label);
  });
  // Two studies may number and name their series alike.
  std::map<std::string, int> seen;
  for (DicomImage& image : images) {
    const int count = ++seen[image.label];
    if (count > 1) image.label += fmt::format(" [{}]", count);
  }
  return images;
}

/// The choices, for a sentence.
std::string choices(const std::vector<const DicomImage*>& images) {
  std::string text;
  for (size_t n = 0; n < images.size() && n < kMostNamed; ++n)
    text += (n > 0 ? "; " : "") + images[n]->label + " (" + describe(*images[n]) + ")";
  if (images.size() > kMostNamed) text += fmt::format("; and {} more", images.size() - kMostNamed);
  return text;
}

/// What chooses the first: the number of its series, if no other has that, or its label.
std::string shortest_name(const Slices& slices, const std::vector<const DicomImage*>& images) {
  const auto number = [&](const DicomImage* image) {
    return slices[image->slices.front()].series_number;
  };
  const auto same = std::count_if(images.begin(), images.end(), [&](const DicomImage* image) {
    return number(image) == number(images.front());
  });
  return same == 1 ? fmt::format("{:g}", number(images.front())) : images.front()->label;
}

/// Leaves those for which `is_better` holds, if there are any.
template <class IsBetter>
void prefer(std::vector<const DicomImage*>& pool, IsBetter is_better) {
  if (std::any_of(pool.begin(), pool.end(), is_better))
    std::erase_if(pool, [&](const DicomImage* image) { return !is_better(image); });
}

/// The magnitude is the picture; phase, real and imaginary parts belong to it.
void prefer_magnitude(std::vector<const DicomImage*>& pool, const Slices& slices) {
  const auto is_part = [&](SignalPart part) {
    return [&slices, part](const DicomImage* image) {
      return component_of(slices[image->slices.front()]) == part;
    };
  };
  const auto magnitudes = std::count_if(pool.begin(), pool.end(), is_part(SignalPart::kMagnitude));
  const auto others = std::count_if(pool.begin(), pool.end(), is_part(SignalPart::kOther));
  if (magnitudes == 1 && size_t(others) + 1 == pool.size())
    prefer(pool, is_part(SignalPart::kMagnitude));
}

Result<DicomLayout> choose_among(const Path& name, const Slices& slices, const Group& all) {
  std::vector<DicomImage> images = images_among(name, slices, all);
  std::vector<const DicomImage*> sequences, volumes;
  const DicomImage* failed = nullptr;
  for (const DicomImage& image : images) {
    if (image.layout)
      (image.layout->frames.size() > 1 ? sequences : volumes).push_back(&image);
    else if (failed == nullptr || image.slices.size() > failed->slices.size())
      failed = &image;
  }
  const bool has_sequence = !sequences.empty();
  std::vector<const DicomImage*> pool = has_sequence ? sequences : volumes;
  const auto is_larger = [&](const DicomImage* image) {
    return failed != nullptr && image->slices.size() < failed->slices.size();
  };
  if (pool.empty() || (!has_sequence && std::all_of(pool.begin(), pool.end(), is_larger)))
    return failed->layout.error();
  const auto is_stack = [&](const DicomImage* image) {
    const DicomSlice& slice = slices[image->slices.front()];
    return image->layout->frames.front().size() >= kStack &&
           slice.kind[size_t(KindTag::kImageType)].find("LOCALIZER") == std::string::npos;
  };
  prefer(pool, is_stack);
  prefer_magnitude(pool, slices);
  if (pool.size() > 1) {
    std::set<std::string> reasons;
    for (const DicomImage* image : pool) reasons.insert(image->differs_in);
    const bool is_kind = reasons.size() == 1 && !reasons.begin()->empty();
    return bad_input(name, "holds {} {}{}: {}; choose one by number or name, as in '{}#{}'",
                     pool.size(),
                     has_sequence ? "sequences" : "images that are no frames of one sequence",
                     is_kind ? fmt::format(", which differ in {}", *reasons.begin()) : "",
                     choices(pool), name.string(), shortest_name(slices, pool));
  }
  DicomLayout layout = *pool.front()->layout;
  std::vector<std::string> left_out;
  for (const DicomImage& image : images)
    if (&image != pool.front()) left_out.push_back(image.label);
  if (!left_out.empty()) {
    const size_t more = left_out.size() - std::min(left_out.size(), kMostNamed);
    left_out.resize(left_out.size() - more);
    layout.notes.push_back(fmt::format("The series {} is read; left out: {}{}.",
                                       pool.front()->label, fmt::join(left_out, "; "),
                                       more > 0 ? fmt::format("; and {} more", more) : ""));
  }
  return layout;
}

/// The slices that a person means by a number or name.
Group slices_named(const Slices& slices, const std::vector<DicomImage>& images,
                   const std::string& wanted) {
  const std::string text = lowered(trimmed(wanted));
  const auto number = to_number(text);
  const auto matching = [&](const auto& is_match) {
    Group found;
    for (const DicomImage& image : images)
      for (const size_t s : image.slices)
        if (is_match(image, slices[s])) found.push_back(s);
    return found;
  };
  Group found = matching(
      [&](const DicomImage& image, const DicomSlice&) { return lowered(image.label) == text; });
  if (found.empty() && number) {
    found = matching(
        [&](const DicomImage&, const DicomSlice& slice) { return slice.series_number == *number; });
  }
  if (found.empty()) {
    found = matching([&](const DicomImage&, const DicomSlice& slice) {
      return lowered(slice.series_description) == text;
    });
  }
  if (found.empty() && !text.empty()) {
    found = matching([&](const DicomImage& image, const DicomSlice& slice) {
      return lowered(slice.series_description).find(text) != std::string::npos ||
             lowered(image.label).find(text) != std::string::npos;
    });
  }
  return found;
}

}  // namespace

std::vector<DicomImage> images_of(const Path& name, const Slices& slices) {
  Group all(slices.size());
  std::iota(all.begin(), all.end(), size_t{0});
  return images_among(name, slices, all);
}

std::string describe(const DicomImage& image) {
  if (!image.layout) {
    const std::string& message = image.layout.error().message;
    const size_t begin = message.find("' ");
    return "not readable: it " + (begin == std::string::npos ? message : message.substr(begin + 2));
  }
  const glm::ivec3 size = image.layout->grid.size;
  const size_t frames = image.layout->frames.size();
  return fmt::format("{} frame{} of {} x {} x {}", frames, frames == 1 ? "" : "s", size.x, size.y,
                     size.z);
}

Result<DicomLayout> choose_image(const Path& name, Slices& slices, const std::string& wanted) {
  if (slices.empty()) return bad_input(name, "holds no DICOM slices: name the folder of the scan");
  Group all(slices.size());
  std::iota(all.begin(), all.end(), size_t{0});
  if (wanted.empty()) return choose_among(name, slices, all);
  const std::vector<DicomImage> images = images_among(name, slices, all);
  std::vector<Group> parts = {slices_named(slices, images, wanted)};
  if (parts.front().empty()) {
    parts.clear();
    for (const std::string_view cell : cells(wanted, ','))
      parts.push_back(slices_named(slices, images, std::string(cell)));
  }
  std::vector<const DicomImage*> known;
  for (const DicomImage& image : images) known.push_back(&image);
  Group together;
  for (const Group& part : parts) {
    if (part.empty())
      return bad_input(name, "holds no series '{}'; it has {}", wanted, choices(known));
    together.insert(together.end(), part.begin(), part.end());
  }
  if (parts.size() == 1) return choose_among(name, slices, together);
  // Several: the frames in this order, or the slices of one stack.
  bool are_frames = true;
  for (size_t n = 0; n < parts.size(); ++n) {
    const auto layout = choose_among(name, slices, parts[n]);
    are_frames = are_frames && layout && layout->frames.size() == 1 &&
                 have_same_shape(slices[parts[n].front()], slices[parts[0].front()]);
  }
  if (!are_frames) return choose_among(name, slices, together);
  for (size_t n = 0; n < parts.size(); ++n)
    for (const size_t s : parts[n]) slices[s].input = n;
  return arrange_slices(name, slices, together);
}

}  // namespace palpate::files
