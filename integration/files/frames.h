#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/frames.h"

namespace palpate::files {

/// Two files as fixed and moving, read at once; their grids may differ. What would take much memory
/// is read again when it is asked for. kBadInput also if they do not overlap, see check_overlap().
/// nan_as: as in read_volume().
Result<Frames> open_pair(const std::filesystem::path& fixed, const std::filesystem::path& moving,
                         std::optional<float> nan_as = {});

/// A file, a folder, or a list of files: also a single frame. nan_as: as in read_volume().
Result<Frames> open_frames(const std::vector<std::filesystem::path>& inputs,
                           std::optional<float> nan_as = {});

/// The same; kBadInput for a single frame.
Result<Frames> open_sequence(const std::vector<std::filesystem::path>& inputs,
                             std::optional<float> nan_as = {});

/// Takes out of a mask what is NaN in any of the frames and becomes nan_as; of no mask, it makes
/// one if there is a NaN. Of a pair on two grids the first frame counts. Reads all frames.
/// kBadInput if nothing is left, or if the mask is on another grid than the frames. Adds a note on
/// how much was taken out.
Result<std::optional<Mask>> mask_of_numbers(const std::vector<std::filesystem::path>& inputs,
                                            float nan_as, std::optional<Mask> mask,
                                            std::vector<std::string>* notes = nullptr);

/// kBadInput if no voxel centre of the fixed frame lies within the moving one, so that there is
/// nothing to compare; says how far apart they are.
Status check_overlap(const std::filesystem::path& fixed, const Grid& fixed_grid,
                     const std::filesystem::path& moving, const Grid& moving_grid);

/// The mask of a file, or none for an empty path. kBadInput if it is on another grid or marks
/// nothing.
Result<std::optional<Mask>> read_mask_for(const std::filesystem::path& file, const Grid& grid,
                                          std::vector<std::string>* notes = nullptr);

/// The name of an image file that palpate can write; folders have none of these endings.
bool has_image_ending(const std::filesystem::path& path);

/// What is unusual of where a grid lies and how fine it is, but not wrong: a sentence each.
std::vector<std::string> unusual_place(const Grid& grid);

/// What a sequence is called: its file without the ending, or its folder; of several files the
/// folder that they share, or the first of them.
std::string sequence_name(const std::vector<std::filesystem::path>& inputs);

/// "115 x 157 x 129 voxels of 1.37 x 1.37 x 2.5 mm".
std::string grid_text(const Grid& grid);

/// "8 of 115 x 157 x 129 voxels of 1.37 x 1.37 x 2.5 mm, 0.5 s apart".
std::string frames_text(const Frames& frames);

}  // namespace palpate::files
