#include "integration/files/dicom_pixels.h"

#include <gdcmPixmapReader.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cstring>

#include "integration/files/dicom_tags.h"
#include "integration/files/raster.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

Error damaged(const std::filesystem::path& path) {
  return bad_input(path,
                   "holds pixels that can not be read: export it again, best without compression");
}

Error cut_short(const std::filesystem::path& path) {
  return bad_input(path, "is cut short within its pixels: export it again");
}

/// GDCM talks to the console of its own accord; a library must not.
void silence_once() {
  static const bool done = [] {
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    return true;
  }();
  (void)done;
}

template <class T>
T swapped(T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  std::reverse(raw, raw + sizeof(T));
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// `n` pixels from number `first` on. Shifting up and down again fills the unused bits with the
/// sign or with zeros.
template <class T, class Layout>
void decode(std::string_view pixels, size_t first, size_t n, const Layout& layout,
            const DicomSlice& slice, float* values) {
  const int unused = layout.allocated - layout.stored;
  for (size_t i = 0; i < n; ++i) {
    const size_t at = layout.swapped_bytes ? (first + i) ^ 1 : first + i;
    T raw;
    std::memcpy(&raw, pixels.data() + at * sizeof(T), sizeof(T));
    if (layout.big_endian) raw = swapped(raw);
    const int64_t value = layout.is_signed
                              ? int64_t(std::make_signed_t<T>(T(raw << unused))) >> unused
                              : int64_t(T(raw << unused) >> unused);
    values[i] = float(slice.slope * double(value) + slice.intercept);
  }
}

}  // namespace

Status DicomPixels::unpack(const std::filesystem::path& path) {
  silence_once();
  try {
    gdcm::PixmapReader reader;
    reader.SetFileName(path.c_str());
    if (!reader.Read()) return damaged(path);
    const gdcm::Pixmap& pixmap = reader.GetPixmap();
    const size_t bytes = pixmap.GetBufferLength();
    const Status fits =
        check_fits_memory(fmt::format("'{}', unpacked,", path.string()), double(bytes));
    if (!fits) return fits;
    unpacked_.resize(bytes);
    if (!pixmap.GetBuffer(unpacked_.data())) return damaged(path);
    // Some codecs correct what the file says of its pixels, so this is asked for last.
    const gdcm::PixelFormat& format = pixmap.GetPixelFormat();
    if (format.GetSamplesPerPixel() != 1) return damaged(path);
    layout_ = {int(format.GetBitsAllocated()), int(format.GetBitsStored()),
               format.GetPixelRepresentation() == 1, false, false};
  } catch (const std::exception&) {
    return damaged(path);
  }
  pixels_ = {unpacked_.data(), unpacked_.size()};
  return Nothing{};
}

Status DicomPixels::open(const std::filesystem::path& path) {
  if (path == path_) return Nothing{};
  path_.clear();
  unpacked_ = {};
  auto file = MappedFile::open(path);
  if (!file) return file.error();
  auto elements = parse_dicom(path, file->bytes());
  if (!elements) return elements.error();
  file_ = std::move(*file);
  elements_ = std::move(*elements);
  if (elements_.is_packed) {
    if (const Status unpacked = unpack(path); !unpacked) return unpacked;
  } else {
    pixels_ = elements_.pixels;
    layout_.allocated = elements_.whole(tags::kBitsAllocated).value_or(0);
    layout_.stored = elements_.whole(tags::kBitsStored).value_or(layout_.allocated);
    layout_.is_signed = elements_.whole(tags::kPixelRepresentation).value_or(0) == 1;
    layout_.big_endian = elements_.big_endian;
    layout_.swapped_bytes =
        elements_.big_endian && elements_.has_word_pixels && layout_.allocated == 8;
  }
  const int bits = layout_.allocated;
  if ((bits != 8 && bits != 16 && bits != 32) || layout_.stored < 1 || layout_.stored > bits) {
    return bad_input(
        path, "has pixels of {} bits, which palpate does not read: export them with 16", bits);
  }
  path_ = path;
  return Nothing{};
}

Status DicomPixels::read(const DicomSlice& slice, float* values) {
  if (const Status opened = open(slice.file); !opened) return opened;
  const size_t n = size_t(slice.size.x) * size_t(slice.size.y), first = n * size_t(slice.frame);
  const size_t width = size_t(layout_.allocated / 8);
  // Bytes in words come in pairs.
  const size_t end = (first + n) * width + (layout_.swapped_bytes ? (first + n) % 2 : 0);
  if (pixels_.size() < end) return cut_short(slice.file);
  if (width == 1) decode<uint8_t>(pixels_, first, n, layout_, slice, values);
  if (width == 2) decode<uint16_t>(pixels_, first, n, layout_, slice, values);
  if (width == 4) decode<uint32_t>(pixels_, first, n, layout_, slice, values);
  return Nothing{};
}

}  // namespace palpate::files
