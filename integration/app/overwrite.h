#pragma once

#include <filesystem>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::app {

/// Errors: kBadInput, with one sentence, if an input is a pipe, a socket or a device: palpate reads
/// headers first and data later, and could wait for ever. Names that do not exist pass. Any thread.
Status check_are_files(const std::vector<std::filesystem::path>& inputs);

/// Checks that no input will be overwritten. Errors: kBadOutput, with one sentence, if
/// - an output is an input, with any spelling of its path (compared by device and inode, links
///   followed). Inputs are the named files, the files of a named folder, and the files that a named
///   scene (.json, .x3d) or header (.mhd, .nhdr) names;
/// - an output folder is an input folder: the next run would read what this one writes;
/// - two outputs are one file;
/// - an output is "-": palpate writes files only.
/// Names that do not exist are no inputs. Reads folders and headers, no image data. Any thread.
Status check_overwrites(const std::vector<std::filesystem::path>& inputs,
                        const std::vector<std::filesystem::path>& outputs);

}  // namespace palpate::app
