#include "tests/files/dicom/dicom_files.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "integration/files/text.h"
#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

/// Elements of a file in one transfer syntax.
class Encoder {
 public:
  explicit Encoder(DicomSyntax syntax, bool open_sequences = false)
      : is_big_(syntax == DicomSyntax::kExplicitBig),
        is_implicit_(syntax == DicomSyntax::kImplicitLittle),
        open_(open_sequences) {}

  template <class T>
  std::string number(T value) const {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (is_big_) std::reverse(raw, raw + sizeof(T));
    return std::string(raw, sizeof(T));
  }

  /// VR, then the value: text is padded to even length, FD, FL, US and UL are numbers.
  std::string element(unsigned tag, const std::string& vr_and_value) const {
    const std::string vr = vr_and_value.substr(0, 2);
    std::string value = vr_and_value.substr(2);
    if (vr == "FD") value = reals(value);
    if (vr == "FL") value = number(std::stof(value));
    if (vr == "US") value = number(uint16_t(std::stoi(value)));
    if (vr == "UL") value = wholes(value);
    if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
    return head(tag, vr, uint32_t(value.size())) + value;
  }

  std::string elements(const DicomValues& values) const {
    std::string bytes;
    for (const auto& [tag, value] : values)
      if (!value.empty()) bytes += element(tag, value);
    return bytes;
  }

  std::string sequence(unsigned tag, const std::vector<std::string>& items) const {
    std::string bytes;
    for (const std::string& item : items) {
      bytes += tag_bytes(0xfffee000u) + number(open_ ? 0xffffffffu : uint32_t(item.size())) + item;
      if (open_) bytes += tag_bytes(0xfffee00du) + number(uint32_t(0));
    }
    if (open_) bytes += tag_bytes(0xfffee0ddu) + number(uint32_t(0));
    return head(tag, "SQ", open_ ? 0xffffffffu : uint32_t(bytes.size())) + bytes;
  }

  /// VR and bytes of pixels. In big endian 16-bit words are swapped, also if they contain two 8-bit
  /// pixels.
  std::string pixels(const std::vector<int>& stored, int bits, const std::string& vr) const {
    std::string bytes;
    for (const int value : stored)
      bytes += bits == 8 ? std::string(1, char(value)) : number(int16_t(value));
    if (bits == 8 && bytes.size() % 2 != 0) bytes += '\0';
    if (bits == 8 && vr == "OW" && is_big_)
      for (size_t b = 0; b < bytes.size(); b += 2) std::swap(bytes[b], bytes[b + 1]);
    return vr + bytes;
  }

 private:
  std::string tag_bytes(unsigned tag) const {
    return number(uint16_t(tag >> 16)) + number(uint16_t(tag & 0xffff));
  }

  std::string head(unsigned tag, const std::string& vr, uint32_t length) const {
    if (is_implicit_) return tag_bytes(tag) + number(length);
    if (vr == "OW" || vr == "OB" || vr == "OF" || vr == "SQ")
      return tag_bytes(tag) + vr + std::string(2, '\0') + number(length);
    return tag_bytes(tag) + vr + number(uint16_t(length));
  }

  std::string reals(const std::string& text) const {
    std::string bytes;
    for (const std::string_view cell : cells(text, '\\')) bytes += number(*to_number(cell));
    return bytes;
  }

  std::string wholes(const std::string& text) const {
    std::string bytes;
    for (const std::string_view cell : cells(text, '\\'))
      bytes += number(uint32_t(*to_integer(cell)));
    return bytes;
  }

  bool is_big_, is_implicit_, open_;
};

std::string deflated(const std::string& bytes) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// The preamble and the file meta group, which is always explicit little endian.
std::string start_of_file(DicomSyntax syntax, const std::string& kind, const std::string& uid) {
  const char* names[] = {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2", "1.2.840.10008.1.2.2",
                         "1.2.840.10008.1.2.1.99"};
  const Encoder plain(DicomSyntax::kExplicitLittle);
  std::string meta;
  meta += plain.element(0x00020001, std::string("OB") + std::string("\0\1", 2));
  meta += plain.element(0x00020002, "UI" + kind);
  meta += plain.element(0x00020003, "UI" + uid);
  meta += plain.element(0x00020010, std::string("UI") + names[int(syntax)]);
  meta += plain.element(0x00020012, "UI1.2.3.4");
  return std::string(128, '\0') + "DICM" +
         plain.element(0x00020000, "UL" + std::to_string(meta.size())) + meta;
}

std::string position_text(const Grid& grid, int slice) {
  const glm::dvec3 x = grid.lps_from_index({0, 0, slice});
  return fmt::format("DS{:.9g}\\{:.9g}\\{:.9g}", x.x, x.y, x.z);
}

std::string orientation_text(const Grid& grid) {
  const glm::dvec3 row = grid.direction[0], column = grid.direction[1];
  return fmt::format("DS{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}\\{:.9g}", row.x, row.y, row.z,
                     column.x, column.y, column.z);
}

std::string pixel_spacing_text(const Grid& grid) {
  return fmt::format("DS{}\\{}", grid.spacing_mm.y, grid.spacing_mm.x);
}

/// The elements of every image.
DicomValues common_values(const Grid& grid, const std::string& kind, const std::string& uid,
                          const std::string& series, int bits) {
  return {{0x00080016, "UI" + kind},
          {0x00080018, "UI" + uid},
          {0x00080060, "CSCT"},
          {0x00100010, "PNTest"},
          {0x00100020, "LO1"},
          {0x0020000d, "UI1.2.3"},
          {0x0020000e, "UI" + series},
          {0x00280002, "US1"},
          {0x00280004, "CSMONOCHROME2"},
          {0x00280010, fmt::format("US{}", grid.size.y)},
          {0x00280011, fmt::format("US{}", grid.size.x)},
          {0x00280100, fmt::format("US{}", bits)},
          {0x00280101, fmt::format("US{}", bits)},
          {0x00280102, fmt::format("US{}", bits - 1)},
          {0x00280103, bits == 8 ? "US0" : "US1"}};
}

void write_file(const std::filesystem::path& path, DicomSyntax syntax, const std::string& start,
                const std::string& data) {
  write_bytes(path, start + (syntax == DicomSyntax::kDeflated ? deflated(data) : data));
}

}  // namespace

void write_dicom(const std::filesystem::path& path, const DicomFile& file) {
  const Grid& grid = file.grid;
  const std::string kind = "1.2.840.10008.5.1.4.1.1.2";
  const std::string uid = fmt::format("{}.{}.{}", file.series, file.instance, file.slice + 1);
  DicomValues data = common_values(grid, kind, uid, file.series, file.bits);
  data[0x00200011] = fmt::format("IS{}", file.series_number);
  data[0x00200013] = fmt::format("IS{}", file.instance);
  data[0x00200032] = position_text(grid, file.slice);
  data[0x00200037] = orientation_text(grid);
  data[0x00180050] = fmt::format("DS{}", grid.spacing_mm.z);
  data[0x00280030] = pixel_spacing_text(grid);
  data[0x00281052] = fmt::format("DS{}", file.intercept);
  data[0x00281053] = fmt::format("DS{}", file.slope);
  for (const auto& [tag, value] : file.more) data[tag] = value;
  const Encoder encoder(file.syntax);
  data[0x7fe00010] = encoder.pixels(file.stored, file.bits, file.pixel_vr);
  write_file(path, file.syntax, start_of_file(file.syntax, kind, uid), encoder.elements(data));
}

void write_dicom_volume(const std::filesystem::path& folder, const Volume& volume) {
  const size_t n = size_t(volume.grid.size.x) * size_t(volume.grid.size.y);
  for (int s = 0; s < volume.grid.size.z; ++s) {
    DicomFile file;
    file.grid = volume.grid;
    file.slice = s;
    file.instance = s + 1;
    for (size_t v = 0; v < n; ++v) file.stored.push_back(int(volume.values[size_t(s) * n + v]));
    write_dicom(folder / fmt::format("{}.dcm", s), file);
  }
}

void write_enhanced(const std::filesystem::path& path, const EnhancedFile& file) {
  const std::string kind = "1.2.840.10008.5.1.4.1.1.2.1", uid = "1.2.3.7.1";
  const Encoder encoder(file.syntax, file.open_sequences);
  DicomValues data = common_values(file.grid, kind, uid, "1.2.3.7", 16);
  data[kTagNumberOfFrames] = fmt::format("IS{}", file.frames.size());
  for (const auto& [tag, value] : file.more) data[tag] = value;

  const auto group = [&](unsigned tag, const DicomValues& values) {
    return encoder.sequence(tag, {encoder.elements(values)});
  };
  const std::string shared =
      (file.without_orientation ? std::string{}
                                : group(0x00209116, {{0x00200037, orientation_text(file.grid)}})) +
      group(0x00289110, {{0x00180050, fmt::format("DS{}", file.grid.spacing_mm.z)},
                         {0x00280030, pixel_spacing_text(file.grid)}});
  std::vector<std::string> frames;
  std::vector<int> stored;
  for (const EnhancedFrame& frame : file.frames) {
    std::map<unsigned, DicomValues> groups = frame.groups;
    if (!groups.count(0x00209113))
      groups[0x00209113] = {{0x00200032, position_text(file.grid, frame.slice)}};
    groups[0x00289145] = {{0x00281052, fmt::format("DS{}", frame.intercept)},
                          {0x00281053, fmt::format("DS{}", frame.slope)},
                          {0x00281054, "LOHU"}};
    std::string bytes;
    for (const auto& [tag, values] : groups) bytes += group(tag, values);
    frames.push_back(bytes);
    stored.insert(stored.end(), frame.stored.begin(), frame.stored.end());
  }
  const std::string data_bytes = encoder.elements(data) + encoder.sequence(0x52009229, {shared}) +
                                 encoder.sequence(0x52009230, frames) +
                                 encoder.element(0x7fe00010, encoder.pixels(stored, 16, "OW"));
  write_file(path, file.syntax, start_of_file(file.syntax, kind, uid), data_bytes);
}

std::string with_cut_fragments(const std::string& bytes) {
  const Encoder plain(DicomSyntax::kExplicitLittle);
  const std::string item("\xfe\xff\x00\xe0", 4);
  const auto length_at = [&](size_t at) {
    uint32_t length = 0;
    std::memcpy(&length, bytes.data() + at, sizeof(length));
    return length;
  };
  const size_t pixels = bytes.find(std::string("\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff", 12));
  size_t at = pixels + 12;
  // Skips the existing table.
  at += 8 + length_at(at + 4);
  std::string table, fragments;
  for (; bytes.compare(at, 4, item) == 0; at += 8 + length_at(at + 4)) {
    table += plain.number(uint32_t(fragments.size()));
    const std::string whole = bytes.substr(at + 8, length_at(at + 4));
    const size_t cut = whole.size() / 4 * 2;
    for (const std::string& piece : {whole.substr(0, cut), whole.substr(cut)})
      fragments += item + plain.number(uint32_t(piece.size())) + piece;
  }
  return bytes.substr(0, pixels + 12) + item + plain.number(uint32_t(table.size())) + table +
         fragments + bytes.substr(at);
}

}  // namespace palpate::files
