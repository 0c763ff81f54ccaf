#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/sequence.h"

namespace palpate::files {

class FrameSource;

/// A sequence whose geometry and times are known at once and whose frames are read when they are
/// asked for, so that unpacking later frames overlaps the work on earlier ones. Move-only; one
/// thread at a time.
///
/// Inputs are one of: a file with several frames (NRRD, 3D Slicer .seq.nrrd with the list axis
/// anywhere, MetaImage, NIfTI); a folder of 3D files, ordered by their names (frame_names.h); a
/// folder (with folders below) of DICOM slices of a 4D series or of one series per phase; a list of
/// 3D files; a list of DICOM folders, one frame each.
class SequenceReader {
 public:
  /// Reads headers only; all frames are known to have one grid when it returns. A single frame is
  /// no error here. kBadInput with a sentence for what can not be read, kOutOfMemory if one frame
  /// does not fit.
  static Result<SequenceReader> open(const std::vector<std::filesystem::path>& inputs);

  SequenceReader(SequenceReader&&) noexcept;
  SequenceReader& operator=(SequenceReader&&) noexcept;
  ~SequenceReader();

  const std::string& name() const { return name_; }  ///< for messages: the first input
  size_t frame_count() const;                        ///< at least one
  const Grid& grid() const;                          ///< of every frame
  const std::vector<double>& times_s() const;  ///< one per frame, rising; 0, 1, 2, ... if not known
  bool times_known() const;
  /// Notes for people that do not stop the work, a sentence each: a header that contradicts itself,
  /// and which of its claims is used.
  const std::vector<std::string>& notes() const;

  /// Frame k as float, rescaled once. Cheapest in rising order: going back reads a packed file
  /// again from its start. kBadInput if the data end early, are damaged, or hold values that are
  /// not finite (how many and where the first is).
  Result<Volume> frame(size_t k);

 private:
  SequenceReader(std::string name, std::unique_ptr<FrameSource> source);
  std::string name_;
  std::unique_ptr<FrameSource> source_;
};

/// All frames at once. Errors as SequenceReader's, kBadInput if there are fewer than two frames,
/// kOutOfMemory if they do not fit together (checked before anything is read). Any thread.
Result<Sequence> read_sequence(const std::vector<std::filesystem::path>& inputs);

}  // namespace palpate::files
