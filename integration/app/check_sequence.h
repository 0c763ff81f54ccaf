#pragma once

#include <filesystem>
#include <vector>

#include "integration/app/progress.h"

namespace palpate::app {

/// The motion of a sequence to be measured, in any of the forms that palpate motion writes.
struct SequenceCheck {
  std::vector<std::filesystem::path> inputs;    ///< see tells_a_sequence()
  std::vector<std::filesystem::path> sequence;  ///< its frames, or none
  std::filesystem::path mask, points;           ///< or empty
  bool cyclic = false;                          ///< of fields from the reference
  bool json = false;
};

/// A folder, the one file, or several fields; a single field does not.
bool tells_a_sequence(const std::vector<std::filesystem::path>& inputs);

/// Measures it per frame and prints: motion, folds at and between frames, acceleration, and with
/// the frames what is left of the motion, and a verdict. Returns the exit code.
int check_sequence(const SequenceCheck& command, Console& console);

}  // namespace palpate::app
