#include "integration/files/dicom/dicom_frames.h"

#include <iterator>
#include <numeric>
#include <optional>

#include "compute/volume/memory.h"
#include "integration/files/dicom/dicom_pixels.h"
#include "integration/files/dicom/dicom_scan.h"
#include "integration/files/dicom/dicom_series.h"
#include "integration/files/raster/samples.h"
#include "integration/files/read_sequence.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

class DicomFrames : public FrameSource {
 public:
  DicomFrames(std::filesystem::path name, std::vector<DicomSlice> slices, DicomLayout layout,
              std::vector<std::string> all_notes)
      : name_(std::move(name)), slices_(std::move(slices)), layout_(std::move(layout)) {
    grid = layout_.grid;
    frame_count = layout_.frames.size();
    times_s = layout_.times_s;
    times_known = layout_.times_known;
    ordered_by = layout_.ordered_by;
    notes = std::move(all_notes);
  }

  Result<Volume> frame(size_t k) override {
    if (k >= frame_count)
      return bad_input(name_, "has {} frames, so there is no frame {}", frame_count, k);
    Volume volume{grid, std::vector<float>(grid.count())};
    const size_t slice_samples = size_t(grid.size.x) * size_t(grid.size.y);
    for (size_t s = 0; s < layout_.frames[k].size(); ++s) {
      const DicomSlice& slice = slices_[layout_.frames[k][s]];
      const Status got = pixels_.read(slice, volume.values.data() + s * slice_samples);
      if (!got) return got.error();
    }
    replace_nan(volume);
    const Status finite = check_finite(name_, k, grid, volume.values.data(), 1);
    if (!finite) return finite.error();
    return volume;
  }

 private:
  std::filesystem::path name_;
  std::vector<DicomSlice> slices_;
  DicomLayout layout_;
  DicomPixels pixels_;
};

NamedSeries named(const std::filesystem::path& input) {
  return split_series(input).value_or(NamedSeries{input, {}});
}

/// The one frame in the n-th of several folders; first: a slice of the first folder.
Result<DicomScan> frame_in_folder(const std::filesystem::path& input, size_t n,
                                  const DicomSlice* first) {
  const NamedSeries series = named(input);
  auto scan = scan_dicom(series.folder);
  if (!scan) return scan.error();
  const auto image = choose_image(series.folder, scan->slices, series.series);
  if (!image) return image.error();
  if (image->frames.size() > 1) {
    return bad_input(input,
                     "holds {} frames, but of several folders each is one frame: name this "
                     "folder alone",
                     image->frames.size());
  }
  DicomScan chosen;
  for (const size_t s : image->frames.front()) chosen.slices.push_back(scan->slices[s]);
  for (DicomSlice& slice : chosen.slices) slice.input = n;
  const DicomSlice& slice = chosen.slices.front();
  if (const char* what = first ? shape_difference(*first, slice) : nullptr) {
    return bad_input(slice.file,
                     "has another {} than '{}': name folders with the frames of one scan", what,
                     first->file.string());
  }
  chosen.notes = scan->notes;
  for (const std::string& note : image->notes) chosen.notes.push_back(note);
  return chosen;
}

}  // namespace

Result<std::vector<DicomEntry>> list_dicom(const std::filesystem::path& folder) {
  const auto scan = scan_dicom(folder);
  if (!scan) return scan.error();
  std::vector<DicomEntry> entries;
  for (const DicomImage& image : images_of(folder, scan->slices))
    entries.push_back({image.label, describe(image)});
  return entries;
}

Result<std::unique_ptr<FrameSource>> open_dicom(const std::vector<std::filesystem::path>& inputs) {
  const std::filesystem::path& name = inputs.front();
  std::vector<DicomSlice> slices;
  std::vector<std::string> notes;
  const auto append = [&](DicomScan& scan) {
    slices.insert(slices.end(), std::make_move_iterator(scan.slices.begin()),
                  std::make_move_iterator(scan.slices.end()));
    notes.insert(notes.end(), scan.notes.begin(), scan.notes.end());
  };
  std::optional<Result<DicomLayout>> layout;
  if (inputs.size() > 1 && std::filesystem::is_directory(named(name).folder)) {
    // A list of folders is one frame per folder.
    for (size_t n = 0; n < inputs.size(); ++n) {
      auto chosen = frame_in_folder(inputs[n], n, slices.empty() ? nullptr : &slices.front());
      if (!chosen) return chosen.error();
      append(*chosen);
    }
    std::vector<size_t> all(slices.size());
    std::iota(all.begin(), all.end(), size_t{0});
    layout = arrange_slices(name, slices, all);
  } else {
    // A list of single slices is one unsorted set.
    for (const std::filesystem::path& input : inputs) {
      auto scan = scan_dicom(named(input).folder);
      if (!scan) return scan.error();
      append(*scan);
    }
    layout = choose_image(named(name).folder, slices, named(name).series);
  }
  if (!*layout) return layout->error();
  const Status fits = check_fits_memory(fmt::format("one frame of '{}'", name.string()),
                                        double((*layout)->grid.count()) * sizeof(float));
  if (!fits) return fits.error();
  notes.insert(notes.end(), (*layout)->notes.begin(), (*layout)->notes.end());
  return std::unique_ptr<FrameSource>(std::make_unique<DicomFrames>(
      name, std::move(slices), std::move(**layout), std::move(notes)));
}

}  // namespace palpate::files
