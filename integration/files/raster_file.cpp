#include "integration/files/raster_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "integration/files/byte_source.h"
#include "integration/files/meta_header.h"
#include "integration/files/nifti_header.h"
#include "integration/files/nrrd_header.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Slicer writes attributes of every frame into the header; even those stay far below this.
constexpr size_t kMaxHeaderBytes = 16 * 1024 * 1024;
constexpr size_t kFirstHeaderBytes = 64 * 1024;
constexpr size_t kDicomMagicAt = 128;

constexpr const char* kFormats = "NRRD, MetaImage, NIfTI and DICOM";

/// The first n bytes of a file, fewer if it is shorter.
Result<std::string> head(const std::filesystem::path& file, size_t n) {
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

FileKind kind_of(std::string_view bytes) {
  if (bytes.starts_with("NRRD000")) return FileKind::kNrrd;
  if (bytes.starts_with("\x1f\x8b")) return FileKind::kPackedNifti;
  if (starts_like_nifti(bytes)) return FileKind::kNifti;
  if (bytes.size() >= kDicomMagicAt + 4 && bytes.substr(kDicomMagicAt, 4) == "DICM")
    return FileKind::kDicom;
  const std::string start = lowered(bytes.substr(0, 4096));
  if (start.find("ndims") != std::string::npos && start.find('=') != std::string::npos)
    return FileKind::kMeta;
  return FileKind::kUnknown;
}

/// Reads on until `end_of_header` finds an end (a length) or the file ends.
template <class EndOfHeader>
Result<std::string> whole_header(const std::filesystem::path& file, EndOfHeader end_of_header) {
  for (size_t n = kFirstHeaderBytes;; n *= 4) {
    auto bytes = head(file, n);
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
  return parse_nifti_header(file, bytes, true);
}

}  // namespace

Result<FileKind> sniff(const std::filesystem::path& file) {
  const auto bytes = head(file, 4096);
  if (!bytes) return bytes.error();
  return kind_of(*bytes);
}

Result<std::string> read_nrrd_header_text(const std::filesystem::path& file) {
  const auto kind = sniff(file);
  if (!kind) return kind.error();
  if (*kind != FileKind::kNrrd) return bad_input(file, "is no NRRD file: check the name");
  return whole_header(file, end_of_nrrd);
}

Result<Raster> read_raster_header(const std::filesystem::path& file) {
  const auto kind = sniff(file);
  if (!kind) return kind.error();
  switch (*kind) {
    case FileKind::kNrrd: {
      const auto text = whole_header(file, end_of_nrrd);
      if (!text) return text.error();
      return parse_nrrd_header(file, *text);
    }
    case FileKind::kMeta: {
      const auto text = whole_header(file, end_of_meta);
      if (!text) return text.error();
      return parse_meta_header(file, *text);
    }
    case FileKind::kNifti: {
      const auto bytes = head(file, kNifti2HeaderBytes);
      if (!bytes) return bytes.error();
      return parse_nifti_header(file, *bytes, false);
    }
    case FileKind::kPackedNifti:
      return read_packed_nifti(file);
    case FileKind::kDicom:
      return bad_input(file, "is DICOM, which can not stand here: convert it to NIfTI or NRRD");
    case FileKind::kUnknown:
      break;
  }
  return bad_input(file, "is in no format that palpate knows: convert it to one of {}", kFormats);
}

bool has_raster_name(const std::filesystem::path& file) {
  const std::string name = lowered(file.filename().string());
  for (const char* ending : {".nrrd", ".nhdr", ".mha", ".mhd", ".nii", ".nii.gz", ".hdr"}) {
    if (name.ends_with(ending)) return true;
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

}  // namespace palpate::files
