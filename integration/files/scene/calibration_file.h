#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "module/calibrate/calibrate.h"

namespace palpate::files {

/// A calibration as it is stored: good for the room in which it was made, as long as the runtime
/// keeps its stage there. Verify it by touching one point.
struct StoredCalibration {
  Calibration calibration;
  std::string space = "stage";  ///< "stage" or "local": what stage_from_device is about
  std::string device;           ///< name of the force device
  std::string headset;          ///< name of the headset
  std::string runtime;          ///< name and version of the OpenXR runtime
};

/// Writes JSON, whole or not at all. kBadOutput.
Status write_calibration(const std::filesystem::path& file, const StoredCalibration& stored);

/// Reads it back. kBadInput, naming file, place and what to change: not there, not JSON, a key
/// missing, wrong or unknown, a rotation that is not of unit length.
Result<StoredCalibration> read_calibration(const std::filesystem::path& file);
/// The same from text; `file` is only for messages.
Result<StoredCalibration> parse_calibration(const std::filesystem::path& file,
                                            std::string_view text);

}  // namespace palpate::files
