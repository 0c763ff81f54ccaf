#include "tests/files/dicom_files.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>

#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

template <class T>
std::string little(T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  return std::string(raw, sizeof(T));
}

/// VR, then the value: text is padded to even length, FD and US are numbers.
std::string element(unsigned tag, const std::string& vr_and_value) {
  const std::string vr = vr_and_value.substr(0, 2);
  std::string value = vr_and_value.substr(2);
  if (vr == "FD") value = little(std::stod(value));
  if (vr == "US") value = little(uint16_t(std::stoi(value)));
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  std::string bytes = little(uint16_t(tag >> 16)) + little(uint16_t(tag & 0xffff)) + vr;
  if (vr == "OW" || vr == "OB")
    return bytes + std::string(2, '\0') + little(uint32_t(value.size())) + value;
  return bytes + little(uint16_t(value.size())) + value;
}

}  // namespace

void write_dicom(const std::filesystem::path& path, const DicomFile& file) {
  const Grid& grid = file.grid;
  const glm::dvec3 position = grid.lps_from_index({0, 0, file.slice});
  const glm::dvec3 row = grid.direction[0], column = grid.direction[1];
  const std::string instance_uid =
      fmt::format("{}.{}.{}", file.series, file.instance, file.slice + 1);
  std::map<unsigned, std::string> data = {
      {0x00080016, "UI1.2.840.10008.5.1.4.1.1.2"},
      {0x00080018, "UI" + instance_uid},
      {0x00080060, "CSCT"},
      {0x00100010, "PNTest"},
      {0x00100020, "LO1"},
      {0x0020000d, "UI1.2.3"},
      {0x0020000e, "UI" + file.series},
      {0x00200011, fmt::format("IS{}", file.series_number)},
      {0x00200013, fmt::format("IS{}", file.instance)},
      {0x00200032, fmt::format("DS{:.9g}\\{:.9g}\\{:.9g}", position.x, position.y, position.z)},
      {0x00200037, fmt::format("DS{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}", row.x, row.y,
                               row.z, column.x, column.y, column.z)},
      {0x00180050, fmt::format("DS{}", grid.spacing_mm.z)},
      {0x00280002, "US1"},
      {0x00280004, "CSMONOCHROME2"},
      {0x00280010, fmt::format("US{}", grid.size.y)},
      {0x00280011, fmt::format("US{}", grid.size.x)},
      {0x00280030, fmt::format("DS{}\\{}", grid.spacing_mm.y, grid.spacing_mm.x)},
      {0x00280100, "US16"},
      {0x00280101, "US16"},
      {0x00280102, "US15"},
      {0x00280103, "US1"},
      {0x00281052, fmt::format("DS{}", file.intercept)},
      {0x00281053, fmt::format("DS{}", file.slope)}};
  for (const auto& [tag, value] : file.more) data[tag] = value;
  std::string pixels = "OW";
  for (const int value : file.stored) pixels += little(int16_t(value));
  data[0x7fe00010] = pixels;

  std::string meta;
  meta += element(0x00020001, std::string("OB") + std::string("\0\1", 2));
  meta += element(0x00020002, "UI1.2.840.10008.5.1.4.1.1.2");
  meta += element(0x00020003, "UI" + instance_uid);
  meta += element(0x00020010, "UI1.2.840.10008.1.2.1");
  meta += element(0x00020012, "UI1.2.3.4");
  std::string bytes(128, '\0');
  bytes += "DICM" + little(uint16_t(2)) + little(uint16_t(0)) + "UL" + little(uint16_t(4)) +
           little(uint32_t(meta.size())) + meta;
  for (const auto& [tag, value] : data) {
    // An empty value takes the element out.
    if (!value.empty()) bytes += element(tag, value);
  }
  write_bytes(path, bytes);
}

}  // namespace palpate::files
