#include "integration/files/segmentation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "compute/volume/memory.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/raster/samples.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostLabels = 1000;  // more are an image, not a segmentation

/// A colour for the n-th part of a file that has none: first those of Okabe and Ito, which the
/// colour-blind can tell apart; then hues a golden angle apart, so that neighbours differ whatever
/// their number.
glm::vec3 colour_of(size_t n) {
  constexpr glm::ivec3 kApart[] = {{86, 180, 233}, {0, 158, 115}, {240, 228, 66}, {204, 121, 167},
                                   {0, 114, 178},  {230, 159, 0}, {213, 94, 0}};
  if (n < std::size(kApart)) return glm::vec3(kApart[n]) / 255.0F;
  constexpr double kGolden = 0.381966;
  const double hue = 6.0 * std::fmod(0.02 + kGolden * double(n), 1.0);
  const auto channel = [&](double at) {
    const double k = std::fmod(at + hue, 6.0);
    return float(0.9 - 0.6 * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

std::string_view key_of(const Raster& raster, size_t segment, const char* name) {
  const auto found = raster.keys.find(fmt::format("Segment{}_{}", segment, name));
  return found == raster.keys.end() ? std::string_view() : trimmed(found->second);
}

bool has_segments(const Raster& raster) {
  return raster.keys.contains("Segment0_ID") || raster.keys.contains("Segment0_Name");
}

/// The parts that the keys of 3D Slicer name. Files from before its layers have a layer for each,
/// with the value 1.
Result<std::vector<LabelledPart>> named_parts(const Raster& raster) {
  std::vector<LabelledPart> parts;
  for (size_t n = 0; raster.keys.contains(fmt::format("Segment{}_ID", n)) ||
                     raster.keys.contains(fmt::format("Segment{}_Name", n));
       ++n) {
    LabelledPart part;
    part.name = key_of(raster, n, "Name");
    if (part.name.empty()) part.name = key_of(raster, n, "ID");
    const auto whole = [&](const char* key, int64_t usual) -> std::optional<int64_t> {
      const std::string_view text = key_of(raster, n, key);
      return text.empty() ? usual : to_integer(text);
    };
    const auto label = whole("LabelValue", 1);
    const auto layer = whole("Layer", raster.lanes > 1 ? int64_t(n) : 0);
    if (!label || *label < INT32_MIN || *label > INT32_MAX || !layer || *layer < 0 ||
        size_t(*layer) >= raster.lanes)
      return bad_input(raster.file,
                       "says of its segment \"{}\" a label or a layer that makes no sense: save "
                       "the segmentation again",
                       part.name);
    part.label = int32_t(*label);
    part.layer = size_t(*layer);
    const auto colour = to_numbers(key_of(raster, n, "Color"));
    part.colour = colour && colour->size() == 3
                      ? glm::clamp(glm::vec3((*colour)[0], (*colour)[1], (*colour)[2]), 0.0F, 1.0F)
                      : colour_of(n);
    // Two of one name could not be told apart.
    const bool taken = std::any_of(parts.begin(), parts.end(), [&](const LabelledPart& other) {
      return other.name == part.name;
    });
    if (taken) part.name += fmt::format(" ({})", n + 1);
    parts.push_back(std::move(part));
  }
  return parts;
}

/// The file's samples as whole numbers, lane by lane.
Result<std::vector<std::vector<int32_t>>> layers_of(const Raster& raster) {
  const Status fits = check_fits_memory(fmt::format("'{}'", raster.file.string()),
                                        8.0 * double(raster.sample_count()));
  if (!fits) return fits.error();
  auto stream = SampleStream::open(raster);
  if (!stream) return stream.error();
  std::vector<std::vector<float>> lanes(raster.lanes, std::vector<float>(raster.grid.count()));
  if (raster.lanes == 1 || raster.inner == raster.grid.count()) {
    for (std::vector<float>& lane : lanes)
      if (const Status got = stream->read(lane.data(), lane.size()); !got) return got.error();
  } else {
    std::vector<float*> to;
    for (std::vector<float>& lane : lanes) to.push_back(lane.data());
    if (const Status got = stream->read_lanes(to, 1); !got) return got.error();
  }
  std::vector<std::vector<int32_t>> layers;
  for (std::vector<float>& lane : lanes) {
    reverse_j(raster.grid, lane.data(), 1);
    std::vector<int32_t> layer(lane.size());
    for (size_t i = 0; i < lane.size(); ++i) {
      // Whole numbers that a float holds exactly.
      if (!(std::abs(lane[i]) <= 16777216.0F) || lane[i] != std::round(lane[i]))
        return bad_input(raster.file,
                         "holds {:.6g}, which is no label, since labels are whole numbers: name a "
                         "segmentation",
                         lane[i]);
      layer[i] = int32_t(lane[i]);
    }
    layers.push_back(std::move(layer));
    lane = {};
  }
  return layers;
}

Result<std::set<int32_t>> labels_in(const fs::path& file, const std::vector<int32_t>& layer) {
  std::set<int32_t> labels;
  int32_t last = 0;
  for (const int32_t label : layer) {
    if (label == last) continue;
    last = label;
    if (label == 0) continue;
    labels.insert(label);
    if (labels.size() > kMostLabels)
      return bad_input(file,
                       "holds more than {} labels: it is an image rather than a segmentation, name "
                       "another file",
                       kMostLabels);
  }
  return labels;
}

bool means(const LabelledPart& part, const std::string& label) {
  return part.name == label || std::to_string(part.label) == label;
}

Error no_label(const fs::path& file) {
  return bad_input(file, "holds no label: every sample is 0, so there is no segment to feel");
}

}  // namespace

Result<Mask> Segmentation::mask(const std::vector<std::string>& labels) const {
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  for (const std::string& label : labels) {
    bool found = false;
    for (const LabelledPart& part : parts) {
      if (!means(part, label)) continue;
      found = true;
      const std::vector<int32_t>& layer = layers[part.layer];
      for (size_t i = 0; i < layer.size(); ++i) mask.values[i] |= layer[i] == part.label;
    }
    if (found) continue;
    std::string known;
    for (const LabelledPart& part : parts)
      known += (known.empty() ? "\"" : ", \"") + part.name + "\"";
    return bad_input(file, "has no segment \"{}\": it has {}", label, known);
  }
  return mask;
}

glm::vec3 Segmentation::colour(const std::vector<std::string>& labels) const {
  for (const std::string& label : labels)
    for (const LabelledPart& part : parts)
      if (means(part, label)) return part.colour;
  return glm::vec3(1.0F);
}

Result<std::vector<Segmentation>> read_segmentation(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error))
    return bad_input(file, "is a folder where a segmentation is needed: name its files");
  auto raster = read_raster_header(file);
  if (!raster) return raster.error();
  const bool slicer = has_segments(*raster);
  if (!slicer && raster->component_count() != 1)
    return bad_input(file, "holds {} values per voxel, but a label has one: name a segmentation",
                     raster->component_count());
  auto layers = layers_of(*raster);
  if (!layers) return layers.error();
  std::vector<std::set<int32_t>> labels;
  for (const std::vector<int32_t>& layer : *layers) {
    auto found = labels_in(file, layer);
    if (!found) return found.error();
    labels.push_back(std::move(*found));
  }
  std::vector<Segmentation> read;
  if (slicer) {
    auto parts = named_parts(*raster);
    if (!parts) return parts.error();
    // What was named but not drawn is no wall.
    std::erase_if(
        *parts, [&](const LabelledPart& part) { return !labels[part.layer].contains(part.label); });
    if (parts->empty()) return no_label(file);
    read.push_back({file, raster->grid, std::move(*layers), std::move(*parts)});
    return read;
  }
  for (size_t k = 0; k < layers->size(); ++k) {
    if (labels[k].empty()) return no_label(file);
    Segmentation one{file, raster->grid, {}, {}};
    for (const int32_t label : labels[k])
      // By its value, so that a label has one colour in all files.
      one.parts.push_back(
          {fmt::format("label {}", label), colour_of(size_t(std::abs(int64_t(label)))), label, 0});
    one.layers.push_back(std::move((*layers)[k]));
    read.push_back(std::move(one));
  }
  return read;
}

bool is_slicer_segmentation(const fs::path& file) {
  const auto raster = read_raster_header(file);
  return raster && has_segments(*raster);
}

}  // namespace palpate::files
