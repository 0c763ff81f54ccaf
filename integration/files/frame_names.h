#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// Files that are the frames of one sequence, in their order, and what a person should know of how
/// that was found, a sentence each.
struct NamedFrames {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> notes;
};

/// Takes the frames of one sequence out of the images of a folder, and orders them, by their names
/// alone. Names of one sequence differ only in numbers (also with decimals, or with a sign), which
/// give the order; the case of letters does not matter. Notes: single files of other names that are
/// left out; names that differ in more than one number or in words only; a number that is missing.
/// kBadInput, in one sentence, where no order is certain: several sequences, two files of one
/// frame, numbers that are decimals or counts. Opens no file. Any thread.
Result<NamedFrames> frames_by_name(const std::filesystem::path& folder,
                                   const std::vector<std::filesystem::path>& images);

/// kBadInput, in one sentence, for three or more files that are listed in the order of their
/// letters
/// ("frame_10" before "frame_2", as a shell lists them) where the numbers in their names give
/// another. Any other order is the caller's own.
Status check_listed_order(const std::vector<std::filesystem::path>& files);

}  // namespace palpate::files
