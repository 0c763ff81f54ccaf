#include "integration/files/dicom_frames.h"

#include "compute/volume/memory.h"
#include "integration/files/dicom_pixels.h"
#include "integration/files/dicom_scan.h"
#include "integration/files/samples.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

class DicomFrames : public FrameSource {
 public:
  DicomFrames(std::filesystem::path name, std::vector<DicomSlice> slices, DicomLayout layout)
      : name_(std::move(name)), slices_(std::move(slices)), layout_(std::move(layout)) {
    grid = layout_.grid;
    frame_count = layout_.frames.size();
    times_s = layout_.times_s;
    times_known = layout_.times_known;
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

}  // namespace

Result<std::unique_ptr<FrameSource>> open_dicom(const std::vector<std::filesystem::path>& inputs) {
  std::vector<DicomSlice> slices;
  // A list of single slices is one unsorted set; a list of folders is one frame per folder.
  const bool folders = std::filesystem::is_directory(inputs.front());
  for (size_t n = 0; n < inputs.size(); ++n) {
    auto found = scan_dicom(inputs[n]);
    if (!found) return found.error();
    for (DicomSlice& slice : *found) {
      slice.input = folders ? n : 0;
      slices.push_back(std::move(slice));
    }
  }
  auto layout = arrange_slices(inputs.front(), slices);
  if (!layout) return layout.error();
  const Status fits = check_fits_memory(fmt::format("one frame of '{}'", inputs.front().string()),
                                        double(layout->grid.count()) * sizeof(float));
  if (!fits) return fits.error();
  return std::unique_ptr<FrameSource>(
      std::make_unique<DicomFrames>(inputs.front(), std::move(slices), std::move(*layout)));
}

}  // namespace palpate::files
