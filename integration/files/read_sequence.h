#pragma once

#include <filesystem>
#include <memory>
#include <optional>
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
/// folder (with folders below) of DICOM slices of a 4D series or of one series per phase. Or a list
/// of 3D files; a list of DICOM folders, one frame each. Among several DICOM images in a folder
/// "FOLDER#SERIES" chooses, see split_series().
class SequenceReader {
 public:
  /// Reads headers only; all frames are known to have one grid when it returns. A single frame is
  /// no error here. kBadInput with a sentence for what can not be read, kOutOfMemory if one frame
  /// does not fit.
  /// nan_as: what samples that are NaN become; without it they are refused.
  static Result<SequenceReader> open(const std::vector<std::filesystem::path>& inputs,
                                     std::optional<float> nan_as = {});

  SequenceReader(SequenceReader&&) noexcept;
  SequenceReader& operator=(SequenceReader&&) noexcept;
  ~SequenceReader();

  const std::string& name() const { return name_; }  ///< for messages: the first input
  size_t frame_count() const;                        ///< at least one
  const Grid& grid() const;                          ///< of every frame
  const std::vector<double>& times_s() const;  ///< one per frame, rising; 0, 1, 2, ... if not known
  bool times_known() const;
  /// What gives the order of DICOM frames: "trigger time (0018,1060)"; empty where the file does.
  const std::string& ordered_by() const;
  /// Notes for people that do not stop the work, a sentence each: a header that contradicts itself,
  /// and which of its claims is used.
  const std::vector<std::string>& notes() const;

  /// 1 where no frame read so far had a NaN that was replaced, 0 elsewhere, shape (nz, ny, nx);
  /// empty if there was none.
  const std::vector<uint8_t>& numbers() const;

  /// Frame k as float, rescaled once. Cheapest in rising order: going back reads a packed file
  /// again from its start. kBadInput if the data end early or are damaged, kNotFinite if they hold
  /// values that are not finite (how many and where the first is).
  Result<Volume> frame(size_t k);

 private:
  SequenceReader(std::string name, std::unique_ptr<FrameSource> source);
  std::string name_;
  std::unique_ptr<FrameSource> source_;
};

/// "FOLDER#SERIES": a folder and the number or name of one of its series (choose_image() in
/// dicom_series.h), in any place where an input is named. Nothing if a file has that name or no
/// folder has.
struct NamedSeries {
  std::filesystem::path folder;
  std::string series;
};
std::optional<NamedSeries> split_series(const std::filesystem::path& input);

/// All frames at once. Errors as SequenceReader's, kBadInput if there are fewer than two frames,
/// kOutOfMemory if they do not fit together (checked before anything is read). Any thread.
Result<Sequence> read_sequence(const std::vector<std::filesystem::path>& inputs);

}  // namespace palpate::files
