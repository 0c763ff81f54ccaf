#include "integration/files/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "compute/volume/memory.h"
#include "integration/files/frame_source.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace fs = std::filesystem;

Status check_overlap(const fs::path& fixed, const Grid& fixed_grid, const fs::path& moving,
                     const Grid& moving_grid) {
  if (has_centre_inside(fixed_grid, moving_grid)) return Nothing{};
  const auto middle = [](const Grid& grid) {
    return grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1));
  };
  return bad_input(
      fixed,
      "and '{}' do not overlap in space, they are {:.4g} mm apart (their middles {:.4g} mm): check "
      "that both are of one patient and keep the scanner's coordinates",
      moving.string(), gap_mm(fixed_grid, moving_grid),
      glm::distance(middle(fixed_grid), middle(moving_grid)));
}

Result<Frames> open_pair(const fs::path& fixed, const fs::path& moving,
                         std::optional<float> nan_as) {
  Frames frames;
  auto first = read_volume(fixed, &frames.notes, nan_as);
  if (!first) return first.error();
  const bool kept = !is_much_memory(2.0 * sizeof(float) * double(first->values.size()));
  if (!kept) first->values = {};
  auto second = read_volume(moving, &frames.notes, nan_as);
  if (!second) return second.error();
  const Status overlap = check_overlap(fixed, first->grid, moving, second->grid);
  if (!overlap) return overlap.error();
  frames.name = fixed.string();
  frames.grid = first->grid;
  frames.count = 2;
  const auto volumes = std::make_shared<std::vector<Volume>>(2);
  if (kept) *volumes = {std::move(*first), std::move(*second)};
  frames.read = [volumes, files = std::vector{fixed, moving}, nan_as](size_t k) -> Result<Volume> {
    if (Volume& there = (*volumes)[k]; !there.values.empty()) return std::exchange(there, {});
    return read_volume(files[k], nullptr, nan_as);
  };
  return frames;
}

Result<Frames> open_frames(const std::vector<fs::path>& inputs, std::optional<float> nan_as) {
  auto opened = SequenceReader::open(inputs, nan_as);
  if (!opened) return opened.error();
  auto reader = std::make_shared<SequenceReader>(std::move(*opened));
  Frames frames;
  frames.name = reader->name();
  frames.grid = reader->grid();
  frames.count = reader->frame_count();
  if (reader->times_known()) frames.times_s = reader->times_s();
  frames.ordered_by = reader->ordered_by();
  frames.notes = reader->notes();
  frames.read = [reader](size_t k) { return reader->frame(k); };
  return frames;
}

Result<Frames> open_sequence(const std::vector<fs::path>& inputs, std::optional<float> nan_as) {
  auto frames = open_frames(inputs, nan_as);
  if (frames && frames->count < 2)
    return bad_input(
        inputs.front(),
        "holds one frame only, but motion needs at least two: name a sequence, or two files");
  return frames;
}

Result<std::optional<Mask>> read_mask_for(const fs::path& file, const Grid& grid,
                                          std::vector<std::string>* notes) {
  if (file.empty()) return std::optional<Mask>();
  auto mask = read_mask(file, notes);
  if (!mask) return mask.error();
  if (!same_geometry(mask->grid, grid)) {
    return bad_input(file, "does not fit the frames, it has {}: resample it to their grid",
                     difference(mask->grid, grid));
  }
  if (std::find(mask->values.begin(), mask->values.end(), 1) == mask->values.end())
    return bad_input(file, "marks no voxel at all: name a mask that is not empty");
  mask->grid = grid;
  return std::optional<Mask>(std::move(*mask));
}

Result<std::optional<Mask>> mask_of_numbers(const std::vector<fs::path>& inputs, float nan_as,
                                            std::optional<Mask> mask,
                                            std::vector<std::string>* notes) {
  auto reader = SequenceReader::open(inputs, nan_as);
  if (!reader && inputs.size() == 2) reader = SequenceReader::open({inputs.front()}, nan_as);
  if (!reader) return reader.error();
  for (size_t k = 0; k < reader->frame_count(); ++k)
    if (const auto frame = reader->frame(k); !frame) return frame.error();
  const std::vector<uint8_t>& numbers = reader->numbers();
  if (numbers.empty()) return mask;
  if (!mask) mask = Mask{reader->grid(), std::vector<uint8_t>(numbers.size(), 1)};
  if (!same_geometry(mask->grid, reader->grid()))
    return bad_input(inputs.front(), "does not fit the mask, it has {}: resample it",
                     difference(reader->grid(), mask->grid));
  size_t left = 0;
  for (size_t v = 0; v < numbers.size(); ++v) {
    mask->values[v] = mask->values[v] != 0 && numbers[v] != 0;
    left += mask->values[v];
  }
  if (left == 0)
    return bad_input(inputs.front(), "has no voxel with a number in all frames: export it again");
  if (notes != nullptr) {
    const auto lost = std::count(numbers.begin(), numbers.end(), uint8_t(0));
    notes->push_back(fmt::format(
        "NaN became {:.6g}: voxels with a NaN in any frame ({:.1f} %) count for nothing.", nan_as,
        100.0 * double(lost) / double(numbers.size())));
  }
  return mask;
}

bool has_image_ending(const fs::path& path) {
  const std::string name = path.filename().string();
  for (const char* ending : {".mha", ".nrrd", ".nii", ".nii.gz"}) {
    if (name.ends_with(ending)) return true;
  }
  return false;
}

std::vector<std::string> unusual_place(const Grid& grid) {
  constexpr double kFine_mm = 0.005;     // not tested below
  constexpr double kCoarse_mm = 50.0;    // no scanner's voxel
  constexpr double kFarthest_mm = 10e3;  // no scanner's table moves as far
  std::vector<std::string> sentences;
  const glm::dvec3 spacing = grid.spacing_mm;
  const double finest = grid.finest_mm(), coarsest = std::max({spacing.x, spacing.y, spacing.z});
  if (finest < kFine_mm)
    sentences.push_back(fmt::format(
        "A spacing of {:.3g} mm is finer than what palpate was tried on: is the unit right?",
        finest));
  if (coarsest > kCoarse_mm)
    sentences.push_back(fmt::format(
        "A spacing of {:.3g} mm is coarser than any scanner's: is the unit right?", coarsest));
  const double away_mm = glm::length(grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1)));
  if (away_mm > kFarthest_mm)
    sentences.push_back(fmt::format(
        "The middle of the image is {:.4g} m from the origin, farther than a scanner's table "
        "moves: is the origin right, in mm?",
        1e-3 * away_mm));
  return sentences;
}

std::string sequence_name(const std::vector<fs::path>& inputs) {
  std::error_code error;
  // Without "." and a slash at the end, which have no name.
  const auto named = [&](const fs::path& path) {
    const fs::path whole = fs::absolute(path, error).lexically_normal();
    return whole.has_filename() ? whole : whole.parent_path();
  };
  const fs::path first = named(inputs.front()), folder = first.parent_path();
  if (fs::is_directory(first, error)) return first.filename().string();
  const bool shared = std::all_of(inputs.begin(), inputs.end(), [&](const fs::path& input) {
    return named(input).parent_path() == folder;
  });
  if (inputs.size() > 1 && shared && folder.has_filename()) return folder.filename().string();
  fs::path name = first.stem();
  for (const char* inner : {".seq", ".nii"})
    if (name.extension() == inner) name = name.stem();
  return name.string();
}

std::string grid_text(const Grid& grid) {
  return fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm", grid.size.x, grid.size.y,
                     grid.size.z, grid.spacing_mm.x, grid.spacing_mm.y, grid.spacing_mm.z);
}

std::string frames_text(const Frames& frames) {
  std::string text = fmt::format("{} of {}", frames.count, grid_text(frames.grid));
  if (frames.times_s.size() < 2) return text;
  const double step = frames.times_s[1] - frames.times_s[0];
  double uneven = 0.0;
  for (size_t k = 1; k < frames.times_s.size(); ++k)
    uneven = std::max(uneven, std::abs(frames.times_s[k] - frames.times_s[k - 1] - step));
  if (uneven > 0.01 * std::abs(step))
    return text + fmt::format(", over {:.4g} s", frames.times_s.back() - frames.times_s.front());
  return text + fmt::format(", {:.4g} s apart", step);
}

}  // namespace palpate::files
