#include "integration/files/raster/raster_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "integration/files/dicom/dicom_elements.h"
#include "integration/files/raster/byte_source.h"
#include "integration/files/raster/meta_header.h"
#include "integration/files/raster/nifti_header.h"
#include "integration/files/raster/nrrd_header.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {

Result<std::string> start_of_file(const std::filesystem::path& file, size_t n) {
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    return bad_input(file, "does not exist: check the name");
  if (std::filesystem::is_directory(file, error))
    return bad_input(file, "is a folder: name a file in it");
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    return bad_input(file, "can not be opened ({}): check the permissions", std::strerror(errno));
  std::string bytes(n, '\0');
  stream.read(bytes.data(), std::streamsize(n));
  bytes.resize(size_t(stream.gcount()));
  if (bytes.empty()) return bad_input(file, "is empty: copy or export it again");
  return bytes;
}

namespace {

/// Slicer writes attributes of every frame into the header; even those stay far below this.
constexpr size_t kMaxHeaderBytes = 16 * 1024 * 1024;
constexpr size_t kFirstHeaderBytes = 64 * 1024;
constexpr std::string_view kGzip = "\x1f\x8b";

bool is_nrrd(std::string_view bytes) {
  return bytes.starts_with("NRRD000");
}

bool is_nifti(std::string_view bytes) {
  return bytes.starts_with(kGzip) || starts_like_nifti(bytes);
}

bool is_meta(std::string_view bytes) {
  const std::string start = lowered(bytes);
  return start.find("ndims") != std::string::npos && start.find('=') != std::string::npos;
}

/// Reads on until `end_of_header` finds an end (a length) or the file ends.
template <class EndOfHeader>
Result<std::string> whole_header(const std::filesystem::path& file, EndOfHeader end_of_header) {
  for (size_t n = kFirstHeaderBytes;; n *= 4) {
    auto bytes = start_of_file(file, n);
    if (!bytes) return bytes.error();
    const size_t end = end_of_header(std::string_view(*bytes));
    if (end != std::string::npos) {
      bytes->resize(end);
      return bytes;
    }
    if (bytes->size() < n) return bytes;
    if (n >= kMaxHeaderBytes)
      return bad_input(file, "has a header without end: it is damaged, save it again");
  }
}

size_t end_of_nrrd(std::string_view bytes) {
  for (size_t at = bytes.find('\n'); at != std::string_view::npos; at = bytes.find('\n', at + 1)) {
    if (bytes.substr(at + 1, 1) == "\n") return at + 2;
    if (bytes.substr(at + 1, 2) == "\r\n") return at + 3;
  }
  return std::string_view::npos;
}

size_t end_of_meta(std::string_view bytes) {
  const std::string lower = lowered(bytes);
  const size_t line = lower.find("elementdatafile");
  if (line == std::string::npos) return line;
  const size_t end = lower.find('\n', line);
  const bool goes_on =
      end == std::string::npos || lower.substr(line, end - line).find("list") != std::string::npos;
  return goes_on ? std::string::npos : end + 1;
}

Result<Raster> read_packed_nifti(const std::filesystem::path& file) {
  ByteSource::Options options;
  options.deflate = true;
  auto source = ByteSource::open({file}, options);
  if (!source) return source.error();
  std::string bytes(kNifti2HeaderBytes, '\0');
  const auto got = source->read(bytes.data(), bytes.size());
  if (!got) return got.error();
  bytes.resize(*got);
  if (!starts_like_nifti(bytes)) {
    return bad_input(file, "is a packed file but no NIfTI image{}: unpack it with gunzip first",
                     start_of_dicom(bytes) ? " (it is DICOM)" : "");
  }
  return parse_nifti_header(file, bytes, true);
}

Result<Raster> read_nrrd(const std::filesystem::path& file) {
  const auto text = whole_header(file, end_of_nrrd);
  if (!text) return text.error();
  return parse_nrrd_header(file, *text);
}

Result<Raster> read_meta(const std::filesystem::path& file) {
  const auto text = whole_header(file, end_of_meta);
  if (!text) return text.error();
  return parse_meta_header(file, *text);
}

Result<Raster> read_nifti(const std::filesystem::path& file) {
  const auto bytes = start_of_file(file, kNifti2HeaderBytes);
  if (!bytes) return bytes.error();
  if (bytes->starts_with(kGzip)) return read_packed_nifti(file);
  return parse_nifti_header(file, *bytes, false);
}

/// MetaImage last: its files begin with any of their fields.
std::vector<RasterFormat>& formats() {
  static std::vector<RasterFormat> all = {
      {"NRRD", {".nrrd", ".nhdr"}, is_nrrd, read_nrrd},
      {"NIfTI", {".nii", ".nii.gz", ".hdr"}, is_nifti, read_nifti},
      {"MetaImage", {".mha", ".mhd"}, is_meta, read_meta},
  };
  return all;
}

/// DICOM, or else the format of the file; neither if it is unknown.
struct FoundFormat {
  bool is_dicom = false;
  const RasterFormat* format = nullptr;
};

Result<FoundFormat> found_in(const std::filesystem::path& file) {
  const auto bytes = start_of_file(file, 4096);
  if (!bytes) return bytes.error();
  if (start_of_dicom(*bytes)) return FoundFormat{true, nullptr};
  for (const RasterFormat& format : formats()) {
    if (format.is_start(*bytes)) return FoundFormat{false, &format};
  }
  return FoundFormat{};
}

}  // namespace

const std::vector<RasterFormat>& raster_formats() {
  return formats();
}

void add_raster_format(RasterFormat format) {
  formats().push_back(std::move(format));
}

const RasterFormat* raster_format_of(const std::filesystem::path& file) {
  const auto found = found_in(file);
  return found ? found->format : nullptr;
}

Result<FileKind> sniff(const std::filesystem::path& file) {
  const auto found = found_in(file);
  if (!found) return found.error();
  if (found->is_dicom) return FileKind::kDicom;
  return found->format != nullptr ? FileKind::kImage : FileKind::kUnknown;
}

Result<std::string> read_nrrd_header_text(const std::filesystem::path& file) {
  const auto bytes = start_of_file(file, 4096);
  if (!bytes) return bytes.error();
  if (!is_nrrd(*bytes)) return bad_input(file, "is no NRRD file: check the name");
  return whole_header(file, end_of_nrrd);
}

Result<Raster> read_raster_header(const std::filesystem::path& file) {
  const auto found = found_in(file);
  if (!found) return found.error();
  if (found->format != nullptr) return found->format->read_header(file);
  if (found->is_dicom)
    return bad_input(file, "is DICOM, which can not stand here: convert it to NIfTI or NRRD");
  std::vector<std::string> names;
  for (const RasterFormat& format : formats()) names.push_back(format.name);
  return bad_input(file, "is in no format that palpate knows: convert it to one of {} and DICOM",
                   fmt::join(names, ", "));
}

bool has_raster_name(const std::filesystem::path& file) {
  const std::string name = lowered(file.filename().string());
  for (const RasterFormat& format : formats()) {
    for (const std::string& ending : format.endings) {
      if (name.ends_with(ending)) return true;
    }
  }
  return false;
}

std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator walk(folder, error), end; !error && walk != end;
       walk.increment(error)) {
    const bool hidden = walk->path().filename().string().starts_with('.');
    if (!hidden && walk->is_regular_file(error) && has_raster_name(walk->path()))
      files.push_back(walk->path());
  }
  std::sort(files.begin(), files.end(),
            [](const std::filesystem::path& a, const std::filesystem::path& b) {
              return natural_less(a.filename().string(), b.filename().string());
            });
  return files;
}

Status check_one_kind(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& images) {
  if (images.empty()) return Nothing{};
  std::error_code error;
  for (std::filesystem::directory_iterator walk(folder, error), end; !error && walk != end;
       walk.increment(error)) {
    const std::string name = walk->path().filename().string();
    if (name.starts_with('.') || name == "DICOMDIR" || has_raster_name(name) ||
        !walk->is_regular_file(error))
      continue;
    const auto kind = sniff(walk->path());
    if (kind && *kind == FileKind::kDicom)
      return bad_input(folder,
                       "holds DICOM files ('{}') and other images ('{}'), and either can be meant: "
                       "name the image, or move it away",
                       name, images.front().filename().string());
  }
  return Nothing{};
}

}  // namespace palpate::files
