#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "integration/app/progress.h"

namespace palpate::app {

/// The motion of a sequence to check, in any form that palpate motion writes.
struct SequenceCheck {
  std::vector<std::filesystem::path> inputs;    ///< see tells_a_sequence()
  std::vector<std::filesystem::path> sequence;  ///< its frames; may be empty
  std::filesystem::path mask, points;           ///< may be empty
  std::optional<float> nan_as;                  ///< what samples become that are NaN
  bool cyclic = false;                          ///< of fields from the reference
  bool json = false;
};

/// True for a folder, a file with one motion, or several fields; false for a single field.
bool tells_a_sequence(const std::vector<std::filesystem::path>& inputs);

/// Measures the motion per frame and prints: motion, folds at and between frames, acceleration;
/// with the frames also the motion that remains, and a verdict. Returns the exit code.
int check_sequence(const SequenceCheck& command, Console& console);

}  // namespace palpate::app
