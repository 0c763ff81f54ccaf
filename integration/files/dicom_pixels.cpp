#include "integration/files/dicom_pixels.h"

#include <gdcmTrace.h>
#include <itkGDCMImageIO.h>

#include <algorithm>
#include <cstring>

#include "integration/files/dicom_elements.h"
#include "integration/files/dicom_tags.h"
#include "integration/files/mapped_file.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

Error damaged(const DicomSlice& slice) {
  return bad_input(slice.file,
                   "holds pixels that can not be read: export it again, best without compression");
}

/// Both libraries talk to the console of their own accord; a library must not.
void silence_once() {
  static const bool done = [] {
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    itk::Object::GlobalWarningDisplayOff();
    return true;
  }();
  (void)done;
}

template <class T>
void copy_as(const std::vector<char>& from, size_t n, float* to) {
  for (size_t i = 0; i < n; ++i) {
    T value;
    std::memcpy(&value, from.data() + i * sizeof(T), sizeof(T));
    to[i] = float(value);
  }
}

/// The type that ITK chose after it applied slope and intercept.
bool copy_samples(itk::IOComponentEnum type, const std::vector<char>& from, size_t n, float* to) {
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return copy_as<uint8_t>(from, n, to), true;
    case itk::IOComponentEnum::CHAR:
      return copy_as<int8_t>(from, n, to), true;
    case itk::IOComponentEnum::USHORT:
      return copy_as<uint16_t>(from, n, to), true;
    case itk::IOComponentEnum::SHORT:
      return copy_as<int16_t>(from, n, to), true;
    case itk::IOComponentEnum::UINT:
      return copy_as<uint32_t>(from, n, to), true;
    case itk::IOComponentEnum::INT:
      return copy_as<int32_t>(from, n, to), true;
    case itk::IOComponentEnum::FLOAT:
      return copy_as<float>(from, n, to), true;
    case itk::IOComponentEnum::DOUBLE:
      return copy_as<double>(from, n, to), true;
    default:
      return false;
  }
}

Status read_packed(const DicomSlice& slice, size_t n, float* values) {
  silence_once();
  try {
    auto io = itk::GDCMImageIO::New();
    io->SetFileName(slice.file.string());
    io->ReadImageInformation();
    if (io->GetNumberOfComponents() != 1 || size_t(io->GetImageSizeInPixels()) != n)
      return damaged(slice);
    std::vector<char> bytes(size_t(io->GetImageSizeInBytes()));
    io->Read(bytes.data());
    if (bytes.size() < n * io->GetComponentSize() ||
        !copy_samples(io->GetComponentType(), bytes, n, values)) {
      return damaged(slice);
    }
  } catch (const std::exception&) {
    return damaged(slice);
  }
  return Nothing{};
}

/// `stored` of `allocated` bits count, the lowest ones; what lies above them may be anything.
struct PixelLayout {
  int allocated = 16;
  int stored = 16;
  bool is_signed = false;
  double slope = 1.0;
  double intercept = 0.0;
};

template <class T>
void decode(std::string_view pixels, size_t n, const PixelLayout& layout, float* values) {
  const int unused = layout.allocated - layout.stored;
  for (size_t i = 0; i < n; ++i) {
    T raw;
    std::memcpy(&raw, pixels.data() + i * sizeof(T), sizeof(T));
    // Shifting up and down again fills the unused bits with the sign or with zeros.
    const int64_t value = layout.is_signed
                              ? int64_t(std::make_signed_t<T>(T(raw << unused))) >> unused
                              : int64_t(T(raw << unused) >> unused);
    values[i] = float(layout.slope * double(value) + layout.intercept);
  }
}

Status read_plain(const DicomSlice& slice, const DicomElements& elements, size_t n, float* values) {
  PixelLayout layout;
  layout.allocated = elements.whole(tags::kBitsAllocated).value_or(0);
  layout.stored = elements.whole(tags::kBitsStored).value_or(layout.allocated);
  layout.is_signed = elements.whole(tags::kPixelRepresentation).value_or(0) == 1;
  layout.slope = elements.number(tags::kSlope).value_or(1.0);
  layout.intercept = elements.number(tags::kIntercept).value_or(0.0);
  const int bits = layout.allocated;
  if ((bits != 8 && bits != 16 && bits != 32) || layout.stored < 1 || layout.stored > bits) {
    return bad_input(slice.file,
                     "has pixels of {} bits, which palpate does not read: export them with 16",
                     bits);
  }
  if (elements.pixels.size() < n * size_t(bits / 8)) {
    return bad_input(slice.file, "is cut short within its pixels: export it again");
  }
  if (bits == 8) decode<uint8_t>(elements.pixels, n, layout, values);
  if (bits == 16) decode<uint16_t>(elements.pixels, n, layout, values);
  if (bits == 32) decode<uint32_t>(elements.pixels, n, layout, values);
  return Nothing{};
}

}  // namespace

Status read_dicom_slice(const DicomSlice& slice, float* values) {
  const auto file = MappedFile::open(slice.file);
  if (!file) return file.error();
  const auto elements = parse_dicom(slice.file, file->bytes());
  if (!elements) return elements.error();
  const size_t n = size_t(slice.size.x) * size_t(slice.size.y);
  return elements->is_packed ? read_packed(slice, n, values)
                             : read_plain(slice, *elements, n, values);
}

}  // namespace palpate::files
