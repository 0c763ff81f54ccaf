#include <windows.h>

#include <system_error>

#include "integration/files/raster/mapped_file.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

struct ClosedHandle {
  HANDLE handle;
  ~ClosedHandle() {
    if (handle && handle != INVALID_HANDLE_VALUE) CloseHandle(handle);
  }
};

std::string cause() {
  return std::system_category().message(int(GetLastError()));
}

}  // namespace

Result<MappedFile> MappedFile::open(const std::filesystem::path& path) {
  const ClosedHandle opened{CreateFileW(path.c_str(), GENERIC_READ,
                                        FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                        nullptr, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr)};
  LARGE_INTEGER size{};
  if (opened.handle == INVALID_HANDLE_VALUE || !GetFileSizeEx(opened.handle, &size))
    return bad_input(path, "can not be opened ({}): check its name and the permissions", cause());
  if (size.QuadPart <= 0) return bad_input(path, "is empty: copy or export it again");
  const ClosedHandle mapping{
      CreateFileMappingW(opened.handle, nullptr, PAGE_READONLY, 0, 0, nullptr)};
  const void* const bytes =
      mapping.handle ? MapViewOfFile(mapping.handle, FILE_MAP_READ, 0, 0, 0) : nullptr;
  if (!bytes) return bad_input(path, "can not be read ({}): check the disk", cause());
  MappedFile file;
  file.bytes_ = {static_cast<const char*>(bytes), size_t(size.QuadPart)};
  return file;
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) UnmapViewOfFile(bytes_.data());
}

}  // namespace palpate::files
