#include "integration/files/read_sequence.h"

#include <algorithm>

#include "compute/volume/memory.h"
#include "integration/files/dicom/dicom_frames.h"
#include "integration/files/frame_names.h"
#include "integration/files/frame_source.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;
using Source = Result<std::unique_ptr<FrameSource>>;

Source open_file(const fs::path& file) {
  if (file.filename() == "DICOMDIR") return open_dicom({file});
  const auto kind = sniff(file);
  if (!kind) return kind.error();
  if (*kind == FileKind::kDicom) {
    auto source = open_dicom({file});
    if (!source || (*source)->frame_count > 1 || (*source)->grid.size.z > 1) return source;
    return bad_input(file,
                     "is a single DICOM slice: name the folder that holds all slices of the scan");
  }
  const auto raster = read_raster_header(file);
  if (!raster) return raster.error();
  return open_raster_frames(*raster);
}

Source open_one(const fs::path& input) {
  std::error_code error;
  if (split_series(input)) return open_dicom({input});
  if (!fs::is_directory(input, error)) return open_file(input);
  const auto images = images_in(input);
  if (images.empty()) return open_dicom({input});
  if (const Status alike = check_one_kind(input, images); !alike) return alike.error();
  if (images.size() == 1) return open_file(images.front());
  const auto frames = frames_by_name(input, images);
  if (!frames) return frames.error();
  auto source = open_frame_files(frames->files);
  if (!source) return source;
  (*source)->ordered_by = "the names of their files";
  (*source)->notes.insert((*source)->notes.end(), frames->notes.begin(), frames->notes.end());
  return source;
}

Source open_several(const std::vector<fs::path>& inputs) {
  size_t dicom = 0;
  size_t folders = 0;
  for (const fs::path& input : inputs) {
    std::error_code error;
    if (split_series(input) || fs::is_directory(input, error)) {
      ++folders;
      continue;
    }
    const auto kind = sniff(input);
    if (!kind) return kind.error();
    dicom += *kind == FileKind::kDicom;
  }
  if (folders == inputs.size() || dicom == inputs.size()) return open_dicom(inputs);
  if (folders + dicom == 0) {
    if (const Status order = check_listed_order(inputs); !order) return order.error();
    return open_frame_files(inputs);
  }
  return bad_input(
      inputs.front(),
      "and the other inputs are of different kinds: name image files only, or DICOM folders only");
}

}  // namespace

SequenceReader::SequenceReader(std::string name, std::unique_ptr<FrameSource> source)
    : name_(std::move(name)), source_(std::move(source)) {}
SequenceReader::SequenceReader(SequenceReader&&) noexcept = default;
SequenceReader& SequenceReader::operator=(SequenceReader&&) noexcept = default;
SequenceReader::~SequenceReader() = default;

Result<SequenceReader> SequenceReader::open(const std::vector<fs::path>& inputs,
                                            std::optional<float> nan_as) {
  if (inputs.empty())
    return Error{ErrorKind::kBadInput, "There is no input: name a file or folder"};
  auto source = inputs.size() == 1 ? open_one(inputs.front()) : open_several(inputs);
  if (!source) return source.error();
  (*source)->nan_as = nan_as;
  return SequenceReader(inputs.front().string(), std::move(*source));
}

std::optional<NamedSeries> split_series(const fs::path& input) {
  std::error_code error;
  const std::string text = input.string();
  if (fs::exists(input, error)) return std::nullopt;
  for (size_t at = text.rfind('#'); at != std::string::npos && at > 0;
       at = text.rfind('#', at - 1)) {
    if (fs::exists(text.substr(0, at), error))
      return NamedSeries{text.substr(0, at), text.substr(at + 1)};
  }
  return std::nullopt;
}

size_t SequenceReader::frame_count() const {
  return source_->frame_count;
}
const Grid& SequenceReader::grid() const {
  return source_->grid;
}
const std::vector<double>& SequenceReader::times_s() const {
  return source_->times_s;
}
bool SequenceReader::times_known() const {
  return source_->times_known;
}
const std::string& SequenceReader::ordered_by() const {
  return source_->ordered_by;
}
const std::vector<std::string>& SequenceReader::notes() const {
  return source_->notes;
}
const std::vector<uint8_t>& SequenceReader::numbers() const {
  return source_->numbers;
}
Result<Volume> SequenceReader::frame(size_t k) {
  return source_->frame(k);
}

Result<Sequence> read_sequence(const std::vector<fs::path>& inputs) {
  auto reader = SequenceReader::open(inputs);
  if (!reader) return reader.error();
  if (reader->frame_count() < 2) {
    return bad_input(
        reader->name(),
        "holds one frame only, but motion needs at least two: name a sequence, or two files");
  }
  const Status fits = check_fits_memory(
      fmt::format("'{}'", reader->name()),
      double(reader->frame_count()) * double(reader->grid().count()) * sizeof(float));
  if (!fits) return fits.error();
  Sequence sequence{reader->name(), {}, reader->times_s(), reader->times_known()};
  for (size_t k = 0; k < reader->frame_count(); ++k) {
    auto frame = reader->frame(k);
    if (!frame) return frame.error();
    sequence.frames.push_back(std::move(*frame));
  }
  return sequence;
}

}  // namespace palpate::files
