#include "integration/files/dicom/dicom_pixels.h"

#include <gdcmPixmap.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "integration/files/dicom/dicom_tags.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

/// The transfer syntax that packs by run lengths, and how many bytes it makes of one at most: two
/// stand for 128.
constexpr std::string_view kRunLengths = "1.2.840.10008.1.2.5";
constexpr double kMostByRunLengths = 64.0;

/// GDCM prints to the console by itself; a library must not.
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

/// What a packed picture says of its own samples.
struct PackedPicture {
  int bits = 0;
  bool is_signed = false;  ///< JPEG and JPEG-LS do not say it: false
};

/// A JPEG, JPEG-LS or JPEG 2000 picture, if it is one gray picture of the slice's size with as many
/// bits as the file has room for, or fewer. GDCM allocates by the file's size but lets decoders
/// write by the picture's.
std::optional<PackedPicture> fitting_picture(std::string_view picture, const DicomSlice& slice,
                                             int allocated_bits) {
  const auto byte = [&](size_t at) { return unsigned(uint8_t(picture[at])); };
  const auto two = [&](size_t at) { return byte(at) << 8 | byte(at + 1); };
  const auto four = [&](size_t at) { return two(at) << 16 | two(at + 2); };
  const auto agrees = [&](unsigned columns, unsigned rows, unsigned bits, unsigned components) {
    return columns == unsigned(slice.picture_size.x) && rows == unsigned(slice.picture_size.y) &&
           bits >= 1 && bits <= unsigned(allocated_bits) && components == 1;
  };
  // JPEG 2000 starts with its size: the far corner, the near one, tiles, and each component.
  if (picture.starts_with("\xff\x4f\xff\x51")) {
    if (picture.size() < 45 || byte(43) != 1 || byte(44) != 1) return std::nullopt;
    const unsigned bits = (byte(42) & 0x7f) + 1;
    if (!agrees(four(8) - four(16), four(12) - four(20), bits, two(40))) return std::nullopt;
    return PackedPicture{int(bits), (byte(42) & 0x80) != 0};
  }
  if (!picture.starts_with("\xff\xd8")) return std::nullopt;
  // JPEG and JPEG-LS are segments with a marker and a length up to the first scan; one of the kind
  // SOF has the size. GDCM ends the process over small errors up to there: bytes between segments,
  // or an unknown version of JFIF.
  std::optional<PackedPicture> found;
  bool is_jpeg_ls = false;
  for (size_t at = 2; at + 10 <= picture.size() && byte(at) == 0xff;) {
    const unsigned marker = byte(at + 1), length = two(at + 2);
    const bool has_length = marker >= 0xc0 && marker != 0xff && !(marker >= 0xd0 && marker <= 0xd9);
    if (!has_length || length < 2 || at + 2 + length > picture.size()) return std::nullopt;
    // The decoder of JPEG-LS may never return from a damaged picture without an end marker.
    if (marker == 0xda && is_jpeg_ls &&
        !picture.substr(0, picture.find_last_not_of('\0') + 1).ends_with("\xff\xd9"))
      return std::nullopt;
    if (marker == 0xda) return found;
    const bool is_frame =
        marker == 0xf7 || (marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc);
    if (is_frame) {
      is_jpeg_ls = is_jpeg_ls || marker == 0xf7;
      const unsigned bits = byte(at + 4);
      if (!agrees(two(at + 7), two(at + 5), bits, byte(at + 9))) return std::nullopt;
      found = PackedPicture{int(bits), false};
    }
    if (marker == 0xe0 && picture.substr(at + 4, 4) == "JFIF" && byte(at + 9) != 1)
      return std::nullopt;
    at += 2 + length;
  }
  return std::nullopt;
}

/// Whether pixels come out of the packing changed: JPEG with a cosine transform, JPEG-LS near to
/// lossless, and JPEG 2000 that may be either.
bool is_lossy(const std::string& syntax) {
  for (const char* number : {"50", "51", "53", "55", "81", "91"}) {
    if (syntax == std::string("1.2.840.10008.1.2.4.") + number) return true;
  }
  return false;
}

/// The frame's part of the packed pixels: all of them, the fragment of its number, or the fragments
/// from its place in the table of offsets on to that of the next frame. Empty if there is none.
std::string packed_frame(const std::vector<std::string_view>& fragments, size_t frame,
                         size_t frames) {
  std::string bytes;
  if (fragments.empty()) return bytes;
  const std::string_view table = fragments.front();
  const size_t count = fragments.size() - 1;
  const auto place_of = [&](size_t n) {
    uint32_t place = UINT32_MAX;
    if (n < frames) std::memcpy(&place, table.data() + n * sizeof(place), sizeof(place));
    return uint64_t(place);
  };
  const bool by_table = frames > 1 && count != frames;
  if (by_table && table.size() < frames * sizeof(uint32_t)) return bytes;
  // Places count from the first fragment on, each of which starts with 8 bytes of tag and length.
  uint64_t place = 0;
  for (size_t n = 0; n < count; ++n) {
    const bool wanted = by_table ? place >= place_of(frame) && place < place_of(frame + 1)
                                 : frames == 1 || n == frame;
    if (wanted) bytes += fragments[n + 1];
    place += 8 + fragments[n + 1].size();
  }
  return bytes;
}

/// Run lengths: bytes of one weight of all pixels lie together, the highest first, each in a
/// segment of its own; a header of 16 numbers says how many segments there are and where they
/// begin.
bool unpack_run_lengths(std::string_view packed, size_t n, size_t width,
                        std::vector<char>& pixels) {
  constexpr size_t kHeaderBytes = 64;
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    std::memcpy(&value, packed.data() + at * sizeof(value), sizeof(value));
    return size_t(value);
  };
  if (packed.size() < kHeaderBytes || number(0) != width) return false;
  pixels.resize(n * width);
  for (size_t segment = 0; segment < width; ++segment) {
    const size_t end = segment + 1 < width ? number(segment + 2) : packed.size();
    size_t at = number(segment + 1), done = 0;
    if (at < kHeaderBytes || end > packed.size()) return false;
    const auto put = [&](char byte) { pixels[done++ * width + (width - 1 - segment)] = byte; };
    while (done < n && at < end) {
      // Up to 127: so many bytes and one more follow; negative: the next one, so many times and one
      // more; -128 is skipped.
      const int code = int8_t(packed[at++]);
      const size_t count = std::min(size_t(code < 0 ? 1 - code : 1 + code), n - done);
      if (code == -128) continue;
      if (at + (code < 0 ? 1 : count) > end) return false;
      for (size_t i = 0; i < count; ++i) put(packed[code < 0 ? at : at + i]);
      at += code < 0 ? 1 : count;
    }
    if (done < n) return false;
  }
  return true;
}

/// The pixels of one frame as GDCM unpacks them, and how they lie; false if it can not.
bool unpack(const std::string& packed, const std::string& syntax, const DicomSlice& slice,
            PixelLayout& layout, std::vector<char>& pixels) {
  if (syntax == kRunLengths) {
    return unpack_run_lengths(packed, size_t(slice.picture_size.x) * size_t(slice.picture_size.y),
                              size_t(layout.allocated / 8), pixels);
  }
  const auto picture = fitting_picture(packed, slice, layout.allocated);
  if (!picture) return false;
  silence_once();
  try {
    gdcm::Pixmap pixmap;
    pixmap.SetNumberOfDimensions(2);
    pixmap.SetDimension(0, unsigned(slice.picture_size.x));
    pixmap.SetDimension(1, unsigned(slice.picture_size.y));
    pixmap.SetPixelFormat(gdcm::PixelFormat(1, uint16_t(layout.allocated), uint16_t(layout.stored),
                                            uint16_t(layout.stored - 1),
                                            uint16_t(layout.is_signed)));
    pixmap.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
    pixmap.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(syntax.c_str()));
    const auto fragments = gdcm::SequenceOfFragments::New();
    gdcm::Fragment fragment;
    fragment.SetByteValue(packed.data(), uint32_t(packed.size()));
    fragments->AddFragment(fragment);
    gdcm::DataElement element(gdcm::Tag(0x7fe0, 0x0010));
    element.SetVR(gdcm::VR::OB);
    element.SetValue(*fragments);
    pixmap.SetDataElement(element);
    pixels.resize(pixmap.GetBufferLength());
    if (!pixmap.GetBuffer(pixels.data())) return false;
    // Some decoders correct the pixel format of the file, so this is read last.
    const gdcm::PixelFormat& format = pixmap.GetPixelFormat();
    if (format.GetSamplesPerPixel() != 1) return false;
    layout = {int(format.GetBitsAllocated()),
              int(format.GetBitsStored()),
              format.GetPixelRepresentation() == 1,
              false,
              false,
              false};
    // After lossy compression a value may exceed the largest one that the file stores. Where the
    // picture has bits for it, cutting them off would make the brightest pixels the darkest.
    if (is_lossy(syntax) && picture->is_signed == layout.is_signed)
      layout.stored = std::max(layout.stored, picture->bits);
  } catch (const std::exception&) {
    return false;
  }
  return true;
}

/// `n` pixels from number `first` on. Shifting up and down again fills the unused bits with the
/// sign or with zeros.
template <class T>
void decode(std::string_view pixels, size_t first, size_t n, const PixelLayout& layout,
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

/// `n` floating-point pixels from number `first` on.
template <class T>
void decode_real(std::string_view pixels, size_t first, size_t n, const PixelLayout& layout,
                 const DicomSlice& slice, float* values) {
  for (size_t i = 0; i < n; ++i) {
    T raw;
    std::memcpy(&raw, pixels.data() + (first + i) * sizeof(T), sizeof(T));
    if (layout.big_endian) raw = swapped(raw);
    values[i] = float(slice.slope * double(raw) + slice.intercept);
  }
}

bool is_readable(const PixelLayout& layout) {
  const int bits = layout.allocated;
  if (layout.is_real) return bits == 32 || bits == 64;
  return (bits == 8 || bits == 16 || bits == 32) && layout.stored >= 1 && layout.stored <= bits;
}

/// The layout of the file's pixels, or a sentence about pixels that are not read.
Result<PixelLayout> layout_of(const DicomElements& elements, const std::filesystem::path& file) {
  PixelLayout layout;
  layout.allocated = elements.whole(tags::kBitsAllocated).value_or(0);
  layout.stored = elements.whole(tags::kBitsStored).value_or(layout.allocated);
  layout.is_signed = elements.whole(tags::kPixelRepresentation).value_or(0) == 1;
  layout.big_endian = elements.big_endian;
  layout.is_real = elements.has_real_pixels;
  layout.swapped_bytes = elements.big_endian && elements.has_word_pixels && layout.allocated == 8;
  if (is_readable(layout)) return layout;
  return bad_input(file, "has pixels of {} bits, which palpate does not read: export them with 16",
                   layout.allocated);
}

Error damaged(const std::filesystem::path& file) {
  return bad_input(file,
                   "holds pixels that can not be read: export it again, best without compression");
}

Error cut_short(const std::filesystem::path& file) {
  return bad_input(file, "is cut short within its pixels: export it again");
}

}  // namespace

Status check_pixels(const DicomElements& elements, const DicomSlice& slice) {
  const auto layout = layout_of(elements, slice.file);
  if (!layout) return layout.error();
  const double bytes = double(slice.picture_size.x) * double(slice.picture_size.y) *
                       layout->allocated / 8.0 * double(slice.frames_in_file);
  if (!elements.is_packed) {
    if (double(elements.pixels.size()) < bytes) return cut_short(slice.file);
    return Nothing{};
  }
  double available = 0.0;
  for (const std::string_view fragment : elements.fragments) available += double(fragment.size());
  if (elements.syntax == kRunLengths) {
    if (available * kMostByRunLengths < bytes) return cut_short(slice.file);
    return Nothing{};
  }
  // A frame in several pieces is checked when it is read.
  if (elements.fragments.size() != slice.frames_in_file + 1) return Nothing{};
  if (!fitting_picture(elements.fragments[1], slice, layout->allocated)) return damaged(slice.file);
  return Nothing{};
}

Status DicomPixels::open(const std::filesystem::path& path) {
  if (path == path_) return Nothing{};
  path_.clear();
  unpacked_frame_.reset();
  auto file = MappedFile::open(path);
  if (!file) return file.error();
  auto elements = parse_dicom(path, file->bytes());
  if (!elements) return elements.error();
  file_ = std::move(*file);
  elements_ = std::move(*elements);
  path_ = path;
  return Nothing{};
}

Status DicomPixels::read(const DicomSlice& slice, float* values) {
  if (const Status opened = open(slice.file); !opened) return opened;
  auto layout = layout_of(elements_, slice.file);
  if (!layout) return layout.error();
  const glm::ivec2 picture = slice.picture_size;
  const size_t n = size_t(picture.x) * size_t(picture.y);
  size_t first = n * slice.frame;
  std::string_view pixels = elements_.pixels;
  if (elements_.is_packed) {
    if (unpacked_frame_ != slice.frame) {
      unpacked_frame_.reset();
      const std::string packed =
          packed_frame(elements_.fragments, slice.frame, slice.frames_in_file);
      if (!unpack(packed, elements_.syntax, slice, *layout, unpacked_) || !is_readable(*layout))
        return damaged(slice.file);
      unpacked_layout_ = *layout;
      unpacked_frame_ = slice.frame;
    }
    layout = unpacked_layout_;
    first = 0;
    pixels = {unpacked_.data(), unpacked_.size()};
  }
  const size_t width = size_t(layout->allocated / 8);
  // Bytes in words come in pairs.
  const size_t end = (first + n) * width + (layout->swapped_bytes ? (first + n) % 2 : 0);
  if (pixels.size() < end) return cut_short(slice.file);
  // Row by row: the slice of a mosaic is a part of the picture.
  const size_t columns = size_t(slice.size.x);
  for (int row = 0; row < slice.size.y; ++row) {
    const size_t at =
        first + size_t(slice.first_pixel.y + row) * size_t(picture.x) + size_t(slice.first_pixel.x);
    float* const to = values + size_t(row) * columns;
    if (layout->is_real && width == 4) decode_real<float>(pixels, at, columns, *layout, slice, to);
    if (layout->is_real && width == 8) decode_real<double>(pixels, at, columns, *layout, slice, to);
    if (layout->is_real) continue;
    if (width == 1) decode<uint8_t>(pixels, at, columns, *layout, slice, to);
    if (width == 2) decode<uint16_t>(pixels, at, columns, *layout, slice, to);
    if (width == 4) decode<uint32_t>(pixels, at, columns, *layout, slice, to);
  }
  return Nothing{};
}

}  // namespace palpate::files
