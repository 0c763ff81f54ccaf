#include "tests/files/itk_images.h"

#include <fmt/format.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmPixmapReader.h>
#include <gdcmPixmapWriter.h>
#include <gdcmTrace.h>
#include <itkDisplacementFieldTransform.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkResampleImageFilter.h>
#include <itkVTKImageIO.h>

#include <limits>
#include <stdexcept>

#include "tests/files/test_images.h"

namespace palpate::files::itk_oracle {
namespace {

itk::ImageIOBase::Pointer io_for(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  itk::ImageIOBase::Pointer io;
  if (name.ends_with(".mha") || name.ends_with(".mhd")) io = itk::MetaImageIO::New();
  if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) io = itk::NrrdImageIO::New();
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) io = itk::NiftiImageIO::New();
  if (name.ends_with(".vtk")) io = itk::VTKImageIO::New();
  if (io.IsNull()) throw std::invalid_argument("no ITK reader for " + name);
  io->SetFileName(path.string());
  return io;
}

itk::IOComponentEnum component_of(SampleType type) {
  switch (type) {
    case SampleType::kInt8:
      return itk::IOComponentEnum::CHAR;
    case SampleType::kUint8:
      return itk::IOComponentEnum::UCHAR;
    case SampleType::kInt16:
      return itk::IOComponentEnum::SHORT;
    case SampleType::kUint16:
      return itk::IOComponentEnum::USHORT;
    case SampleType::kInt32:
      return itk::IOComponentEnum::INT;
    case SampleType::kUint32:
      return itk::IOComponentEnum::UINT;
    case SampleType::kFloat:
      return itk::IOComponentEnum::FLOAT;
    case SampleType::kDouble:
      return itk::IOComponentEnum::DOUBLE;
    default:
      throw std::invalid_argument("a type that this oracle does not write");
  }
}

std::string packed(const std::vector<float>& values, SampleType type) {
  switch (type) {
    case SampleType::kInt8:
      return bytes_of_values<int8_t>(values);
    case SampleType::kUint8:
      return bytes_of_values<uint8_t>(values);
    case SampleType::kInt16:
      return bytes_of_values<int16_t>(values);
    case SampleType::kUint16:
      return bytes_of_values<uint16_t>(values);
    case SampleType::kInt32:
      return bytes_of_values<int32_t>(values);
    case SampleType::kUint32:
      return bytes_of_values<uint32_t>(values);
    case SampleType::kFloat:
      return bytes_of_values<float>(values);
    default:
      return bytes_of_values<double>(values);
  }
}

void set_geometry(itk::ImageIOBase& io, const Grid& grid, size_t frames,
                  const WriteOptions& options) {
  const unsigned n = options.four_d || frames > 1 ? 4 : 3;
  io.SetNumberOfDimensions(n);
  itk::ImageIORegion region(n);
  for (unsigned a = 0; a < n; ++a) {
    std::vector<double> direction(n, 0.0);
    direction[a] = 1.0;
    size_t size = frames;
    double spacing = options.time_step_s, origin = options.time_start_s;
    if (a < 3) {
      for (unsigned r = 0; r < 3; ++r) direction[r] = grid.direction[int(a)][int(r)];
      size = size_t(grid.size[int(a)]);
      spacing = grid.spacing_mm[int(a)];
      origin = grid.origin_mm[int(a)];
    }
    io.SetDimensions(a, size);
    io.SetSpacing(a, spacing);
    io.SetOrigin(a, origin);
    io.SetDirection(a, direction);
    region.SetIndex(a, 0);
    region.SetSize(a, size);
  }
  io.SetIORegion(region);
}

using Vectors = itk::Image<itk::Vector<float, 3>, 3>;
using Scalars = itk::Image<float, 3>;

template <class Image>
typename Image::Pointer load(const std::filesystem::path& path) {
  auto reader = itk::ImageFileReader<Image>::New();
  reader->SetImageIO(io_for(path));
  reader->SetFileName(path.string());
  reader->Update();
  return reader->GetOutput();
}

template <class Image>
Grid grid_of(const Image& image) {
  Grid grid;
  for (unsigned a = 0; a < 3; ++a) {
    const int axis = int(a);
    grid.size[axis] = int(image.GetLargestPossibleRegion().GetSize()[a]);
    grid.spacing_mm[axis] = image.GetSpacing()[a];
    grid.origin_mm[axis] = image.GetOrigin()[a];
    for (unsigned r = 0; r < 3; ++r) grid.direction[axis][int(r)] = image.GetDirection()(r, a);
  }
  return grid;
}

Scalars::Pointer to_itk(const Volume& volume) {
  auto image = Scalars::New();
  Scalars::SizeType size;
  Scalars::SpacingType spacing;
  Scalars::PointType origin;
  Scalars::DirectionType direction;
  for (unsigned a = 0; a < 3; ++a) {
    const int axis = int(a);
    size[a] = itk::SizeValueType(volume.grid.size[axis]);
    spacing[a] = volume.grid.spacing_mm[axis];
    origin[a] = volume.grid.origin_mm[axis];
    for (unsigned r = 0; r < 3; ++r) direction(r, a) = volume.grid.direction[axis][int(r)];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->Allocate();
  std::copy(volume.values.begin(), volume.values.end(), image->GetBufferPointer());
  return image;
}

}  // namespace

void write(const std::filesystem::path& path, const std::vector<Volume>& frames,
           const WriteOptions& options) {
  auto io = io_for(path);
  set_geometry(*io, frames.front().grid, frames.size(), options);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetNumberOfComponents(1);
  io->SetComponentType(component_of(options.type));
  io->SetUseCompression(options.compressed);
  std::string bytes;
  for (const Volume& frame : frames) bytes += packed(frame.values, options.type);
  io->Write(bytes.data());
}

void write_field(const std::filesystem::path& path, const Field& field) {
  auto io = io_for(path);
  set_geometry(*io, field.grid, 1, {});
  io->SetPixelType(itk::IOPixelEnum::VECTOR);
  io->SetNumberOfComponents(3);
  io->SetComponentType(itk::IOComponentEnum::FLOAT);
  io->Write(field.u_mm.data());
}

void write_dicom_series(const std::filesystem::path& folder, const Volume& volume, bool packed) {
  // It warns of a missing tag that it then adds itself.
  gdcm::Trace::WarningOff();
  const Grid& grid = volume.grid;
  const size_t n = size_t(grid.size.x) * size_t(grid.size.y);
  for (int s = 0; s < grid.size.z; ++s) {
    auto io = itk::GDCMImageIO::New();
    io->SetFileName((folder / fmt::format("{}.dcm", s)).string());
    Grid one = grid;
    one.size.z = 1;
    one.origin_mm = grid.lps_from_index({0, 0, s});
    set_geometry(*io, one, 1, {});
    io->SetPixelType(itk::IOPixelEnum::SCALAR);
    io->SetNumberOfComponents(1);
    io->SetComponentType(itk::IOComponentEnum::SHORT);
    io->KeepOriginalUIDOn();
    io->SetUseCompression(packed);
    io->SetCompressionType(itk::GDCMImageIO::CompressionEnum::JPEG);
    auto& tags = io->GetMetaDataDictionary();
    itk::EncapsulateMetaData<std::string>(tags, "0008|0016", "1.2.840.10008.5.1.4.1.1.2");
    itk::EncapsulateMetaData<std::string>(tags, "0008|0060", "CT");
    itk::EncapsulateMetaData<std::string>(tags, "0020|000d", "1.2.3");
    itk::EncapsulateMetaData<std::string>(tags, "0020|000e", "1.2.3.4");
    itk::EncapsulateMetaData<std::string>(tags, "0008|0018", fmt::format("1.2.3.4.{}", s + 1));
    const std::vector<float> values(volume.values.begin() + long(n) * s,
                                    volume.values.begin() + long(n) * (s + 1));
    io->Write(bytes_of_values<int16_t>(values).data());
  }
}

bool pack_dicom(const std::filesystem::path& from, const std::filesystem::path& to,
                const char* syntax, double rate) {
  // As a pixmap, not as an image: for an image GDCM would write the places of frames in its own
  // way.
  gdcm::PixmapReader reader;
  reader.SetFileName(from.c_str());
  if (!reader.Read()) return false;
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(syntax));
  change.SetInput(reader.GetPixmap());
  gdcm::JPEG2000Codec lossy;
  lossy.SetReversible(false);
  lossy.SetRate(0, rate);
  if (rate > 0.0) change.SetUserCodec(&lossy);
  if (!change.Change()) return false;
  gdcm::PixmapWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetPixmap(dynamic_cast<const gdcm::Pixmap&>(change.GetOutputAsBitmap()));
  writer.SetFileName(to.c_str());
  return writer.Write();
}

std::vector<double> read_dicom(const std::filesystem::path& path) {
  auto reader = itk::ImageFileReader<itk::Image<double, 2>>::New();
  reader->SetImageIO(itk::GDCMImageIO::New());
  reader->SetFileName(path.string());
  reader->Update();
  const auto* image = reader->GetOutput();
  const size_t n = image->GetLargestPossibleRegion().GetNumberOfPixels();
  return {image->GetBufferPointer(), image->GetBufferPointer() + n};
}

Read read(const std::filesystem::path& path) {
  auto io = io_for(path);
  io->ReadImageInformation();
  Read found;
  found.components = io->GetNumberOfComponents();
  if (found.components == 3) {
    const auto image = load<Vectors>(path);
    found.grid = grid_of(*image);
    const float* values = image->GetBufferPointer()->GetDataPointer();
    found.values.assign(values, values + 3 * found.grid.count());
  } else {
    const auto image = load<Scalars>(path);
    found.grid = grid_of(*image);
    found.values.assign(image->GetBufferPointer(), image->GetBufferPointer() + found.grid.count());
  }
  return found;
}

std::vector<float> warp(const Volume& moving, const std::filesystem::path& field_file) {
  using Transform = itk::DisplacementFieldTransform<double, 3>;
  auto reader = itk::ImageFileReader<Transform::DisplacementFieldType>::New();
  reader->SetImageIO(io_for(field_file));
  reader->SetFileName(field_file.string());
  reader->Update();
  auto transform = Transform::New();
  transform->SetDisplacementField(reader->GetOutput());
  auto image = to_itk(moving);
  auto resample = itk::ResampleImageFilter<Scalars, Scalars>::New();
  resample->SetInput(image);
  resample->SetTransform(transform);
  resample->SetReferenceImage(image);
  resample->UseReferenceImageOn();
  resample->SetDefaultPixelValue(std::numeric_limits<float>::quiet_NaN());
  resample->Update();
  const float* values = resample->GetOutput()->GetBufferPointer();
  return {values, values + moving.grid.count()};
}

}  // namespace palpate::files::itk_oracle
