#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "compute/volume/result.h"
#include "compute/volume/sequence_motion.h"
#include "integration/files/raster/raster.h"

namespace palpate::files {

/// The file of one motion for a whole sequence: a NRRD of five axes, little-endian floats,
///
///   sizes: 3 nx ny nz M      kinds: vector domain domain domain list
///
/// mm along L, P, S; x, y, z are the motion's grid and M its terms (SequenceMotion::terms, in
/// order: with H harmonics c_0, a_1, b_1, ... a_H, b_H, else u at each frame). Keys:
///
///   SequenceMotion.Version:=1
///   SequenceMotion.ReferenceFrame:=7        counted from 0
///   SequenceMotion.FrameTimes_s:=0 0.05 ...  rising, the first 0
///   SequenceMotion.Cycle_s:=1               above the last time; 0: not cyclic
///   SequenceMotion.Harmonics:=5             0: u at the frames, smooth curves between them
///   SequenceMotion.FramesSize:=64 64 32     the grid of the frames, where it is known: samples,
///   SequenceMotion.FramesSpacing_mm:=1 1 2  spacing, place of the first sample (LPS mm) and the
///   SequenceMotion.FramesOrigin_mm:=0 0 0   directions of x, y, z, three numbers each
///   SequenceMotion.FramesDirections:=1 0 0 0 1 0 0 0 1
///   SequenceMotion.Clock:=frames            TimeBasis says how u follows from the terms
///   SequenceMotion.RepeatsFirst:=0          1: the last frame is the first once more
///
/// The last two may be missing, as in files of earlier versions, whose harmonics are in time and
/// not in frames: such a file is refused if its frames are not at even times.
///
/// Whatever reads NRRD reads it; the same layout without the keys is 3D Slicer's of a sequence of
/// displacement fields.
inline constexpr const char* kSequenceMotionName = "sequence_motion.nrrd";

/// What the header of such a file says.
struct SequenceMotionHeader {
  Raster raster;  ///< its lanes are all components of all terms, in the order of the file
  size_t reference = 0;
  TimeBasis basis;
  std::optional<Grid> frames_grid;
};

/// Pure; `text` is all before the first sample. kBadInput with a sentence for any other NRRD.
Result<SequenceMotionHeader> parse_sequence_motion_header(const std::filesystem::path& file,
                                                          std::string_view text);

/// Whether a path names such a file (by its key, not by its name). False for what can not be read:
/// whoever reads it then says why.
bool holds_sequence_motion(const std::filesystem::path& file);

/// Any thread. kBadInput with a sentence, kOutOfMemory if it does not fit (checked first).
Result<SequenceMotionHeader> read_sequence_motion_header(const std::filesystem::path& file);
Result<SequenceMotion> read_sequence_motion(const std::filesystem::path& file);

/// The whole file or none; read again the terms and times are the same bit by bit. kBadOutput, also
/// for a name that does not end in .nrrd.
Status write_sequence_motion(const SequenceMotion& motion, const std::filesystem::path& file);

}  // namespace palpate::files
