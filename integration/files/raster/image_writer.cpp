#include "integration/files/raster/image_writer.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <functional>

#include "integration/files/atomic_file.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

constexpr size_t kChunkBytes = 256 * 1024;
constexpr int kMaxNiftiSize = 32767;

using Sink = std::function<Status(const void*, size_t)>;

/// A gzip stream into a file. Level 1: fields and noise gain a few per cent more from level 6, at
/// five times the time.
class Packer {
 public:
  explicit Packer(AtomicFile& file) : file_(file), packed_(kChunkBytes) {
    ready_ = deflateInit2(&stream_, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  }
  Packer(const Packer&) = delete;
  Packer& operator=(const Packer&) = delete;
  ~Packer() {
    if (ready_) deflateEnd(&stream_);
  }

  Status write(const void* bytes, size_t n) {
    const char* from = static_cast<const char*>(bytes);
    for (size_t done = 0; done < n;) {
      const uInt count = uInt(std::min<size_t>(n - done, 1u << 30));
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(from + done));
      stream_.avail_in = count;
      if (const Status packed = pack(Z_NO_FLUSH); !packed) return packed;
      done += count;
    }
    return Nothing{};
  }
  Status finish() { return pack(Z_FINISH); }

 private:
  Status pack(int flush) {
    if (!ready_)
      return Error{ErrorKind::kOutOfMemory,
                   "There is not enough memory to pack a file: close other programs"};
    do {
      stream_.next_out = packed_.data();
      stream_.avail_out = uInt(packed_.size());
      deflate(&stream_, flush);
      const Status written = file_.write(packed_.data(), packed_.size() - stream_.avail_out);
      if (!written) return written;
    } while (stream_.avail_out == 0);
    return Nothing{};
  }

  AtomicFile& file_;
  z_stream stream_{};
  std::vector<Bytef> packed_;
  bool ready_ = false;
};

/// The components [first, first + count) of a frame in the order of the file, slice by slice.
Status write_reordered(const ImageToWrite& picture, const void* frame, size_t first, size_t count,
                       const Sink& sink) {
  const size_t nx = size_t(picture.grid.size.x), ny = size_t(picture.grid.size.y);
  const size_t width = bytes_of(picture.type), voxel = picture.components * width;
  const size_t part = count * width;
  std::vector<char> slice(nx * ny * part);
  const char* from = static_cast<const char*>(frame) + first * width;
  for (int k = 0; k < picture.grid.size.z; ++k, from += nx * ny * voxel) {
    for (size_t j = 0; j < ny; ++j) {
      const char* row = from + (picture.grid.j_reversed_in_file ? ny - 1 - j : j) * nx * voxel;
      char* const to = slice.data() + j * nx * part;
      if (part == voxel) {
        std::memcpy(to, row, nx * voxel);
      } else {
        for (size_t i = 0; i < nx; ++i) std::memcpy(to + i * part, row + i * voxel, part);
      }
    }
    if (const Status written = sink(slice.data(), slice.size()); !written) return written;
  }
  return Nothing{};
}

/// `planes`: each component in a block of its own, as NIfTI keeps them.
Status write_samples(const ImageToWrite& picture, bool planes, const Sink& sink) {
  const size_t all = picture.components, together = planes ? 1 : all;
  const bool as_it_is = together == all && !picture.grid.j_reversed_in_file;
  for (const void* frame : picture.frames) {
    if (as_it_is) {
      const Status written = sink(frame, picture.grid.count() * all * bytes_of(picture.type));
      if (!written) return written;
      continue;
    }
    for (size_t c = 0; c < all; c += together) {
      const Status written = write_reordered(picture, frame, c, together, sink);
      if (!written) return written;
    }
  }
  return Nothing{};
}

Status check_nifti_size(const std::filesystem::path& path, const Grid& grid) {
  if (std::max({grid.size.x, grid.size.y, grid.size.z}) <= kMaxNiftiSize) return Nothing{};
  return bad_output(path, "can not hold more than {} samples along an axis: write .mha or .nrrd",
                    kMaxNiftiSize);
}

Status write_scalar(const Grid& grid, const float* values, const std::filesystem::path& path) {
  ImageToWrite picture;
  picture.grid = grid;
  picture.frames = {values};
  return write_picture(picture, path);
}

}  // namespace

Result<ImageFormat> format_of(const std::filesystem::path& path) {
  const std::string name = lowered(path.filename().string());
  if (name.ends_with(".mha")) return ImageFormat::kMeta;
  if (name.ends_with(".nrrd")) return ImageFormat::kNrrd;
  if (name.ends_with(".nii")) return ImageFormat::kNifti;
  if (name.ends_with(".nii.gz")) return ImageFormat::kPackedNifti;
  return bad_output(
      path, "does not end in a format that palpate writes: name it .mha, .nrrd, .nii.gz or .nii");
}

Status write_picture(const ImageToWrite& picture, const std::filesystem::path& path) {
  const auto format = format_of(path);
  if (!format) return format.error();
  const bool nifti = *format == ImageFormat::kNifti || *format == ImageFormat::kPackedNifti;
  if (nifti) {
    if (const Status fits = check_nifti_size(path, picture.grid); !fits) return fits;
  }
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  const std::string header = nifti                           ? nifti_header_of(picture)
                             : *format == ImageFormat::kMeta ? meta_header_of(picture)
                                                             : nrrd_header_of(picture);
  const auto write_all = [&](const Sink& sink) {
    const Status written = sink(header.data(), header.size());
    return written ? write_samples(picture, nifti, sink) : written;
  };
  if (*format == ImageFormat::kPackedNifti) {
    Packer packer(*file);
    const Status written =
        write_all([&](const void* bytes, size_t n) { return packer.write(bytes, n); });
    if (!written) return written;
    if (const Status finished = packer.finish(); !finished) return finished;
  } else {
    const Status written =
        write_all([&](const void* bytes, size_t n) { return file->write(bytes, n); });
    if (!written) return written;
  }
  return file->commit();
}

Status write_volume(const Volume& volume, const std::filesystem::path& path) {
  return write_scalar(volume.grid, volume.values.data(), path);
}

Status write_confidence(const Confidence& confidence, const std::filesystem::path& path) {
  return write_scalar(confidence.grid, confidence.values.data(), path);
}

Status write_deviation(const Deviation& deviation, const std::filesystem::path& path) {
  static_assert(sizeof(glm::vec2) == 2 * sizeof(float), "pairs are written as runs of floats");
  ImageToWrite picture;
  picture.grid = deviation.grid;
  picture.components = 2;
  picture.frames = {deviation.mm.data()};
  return write_picture(picture, path);
}

Status write_mask(const Mask& mask, const std::filesystem::path& path) {
  std::vector<uint8_t> ones(mask.values.size());
  std::transform(mask.values.begin(), mask.values.end(), ones.begin(),
                 [](uint8_t v) { return uint8_t(v != 0); });
  ImageToWrite picture;
  picture.grid = mask.grid;
  picture.type = SampleType::kUint8;
  picture.frames = {ones.data()};
  return write_picture(picture, path);
}

Status write_field(const Field& field, const std::filesystem::path& path) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "vectors are written as runs of floats");
  ImageToWrite picture;
  picture.grid = field.grid;
  picture.components = 3;
  picture.frames = {field.u_mm.data()};
  return write_picture(picture, path);
}

Status write_sequence(const Sequence& sequence, const std::filesystem::path& path) {
  if (!lowered(path.filename().string()).ends_with(".nrrd")) {
    return bad_output(path, "can not hold a sequence with its times: name it .seq.nrrd");
  }
  ImageToWrite picture;
  picture.grid = sequence.frames.front().grid;
  for (const Volume& frame : sequence.frames) picture.frames.push_back(frame.values.data());
  if (sequence.times_known) picture.times_s = sequence.times_s;
  return write_picture(picture, path);
}

Status check_can_write_image(const std::filesystem::path& path, double bytes) {
  const auto format = format_of(path);
  if (!format) return format.error();
  return check_can_write_file(path, bytes);
}

}  // namespace palpate::files
