#include "integration/files/raster/samples.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

static_assert(std::endian::native == std::endian::little,
              "byte order is swapped for big-endian files only");

/// Samples decoded at a time: the bytes stay in the second-level cache between unpacking and
/// conversion.
constexpr size_t kChunkSamples = 32 * 1024;

template <class T>
T swapped(T value) {
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  std::reverse(bytes, bytes + sizeof(T));
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

template <class T>
void convert_as(const char* from, size_t n, const Raster& raster, float* to) {
  const bool scaled = raster.slope != 1.0 || raster.intercept != 0.0;
  for (size_t i = 0; i < n; ++i) {
    T value;
    std::memcpy(&value, from + i * sizeof(T), sizeof(T));
    if (raster.big_endian) value = swapped(value);
    // In double, so that a large intercept does not eat the digits of a small slope.
    to[i] = scaled ? float(raster.slope * double(value) + raster.intercept) : float(value);
  }
}

void convert(const char* from, size_t n, const Raster& raster, float* to) {
  switch (raster.type) {
    case SampleType::kInt8:
      return convert_as<int8_t>(from, n, raster, to);
    case SampleType::kUint8:
      return convert_as<uint8_t>(from, n, raster, to);
    case SampleType::kInt16:
      return convert_as<int16_t>(from, n, raster, to);
    case SampleType::kUint16:
      return convert_as<uint16_t>(from, n, raster, to);
    case SampleType::kInt32:
      return convert_as<int32_t>(from, n, raster, to);
    case SampleType::kUint32:
      return convert_as<uint32_t>(from, n, raster, to);
    case SampleType::kInt64:
      return convert_as<int64_t>(from, n, raster, to);
    case SampleType::kUint64:
      return convert_as<uint64_t>(from, n, raster, to);
    case SampleType::kFloat:
      return convert_as<float>(from, n, raster, to);
    case SampleType::kDouble:
      return convert_as<double>(from, n, raster, to);
  }
}

bool is_plain_float(const Raster& raster) {
  return raster.type == SampleType::kFloat && !raster.big_endian && raster.slope == 1.0 &&
         raster.intercept == 0.0;
}

}  // namespace

SampleStream::SampleStream(Raster raster, ByteSource source)
    : raster_(std::move(raster)), source_(std::move(source)) {}

Result<SampleStream> SampleStream::open(const Raster& raster) {
  if (const Status good = check_claims(raster); !good) return good.error();
  ByteSource::Options options;
  options.deflate = raster.encoding == Encoding::kDeflate;
  options.hex = raster.encoding == Encoding::kHex;
  options.file_skip = raster.file_skip;
  options.line_skip = raster.line_skip;
  if (raster.samples_at_end) options.last_bytes = raster.byte_count() / raster.data.size();
  auto source = ByteSource::open(raster.data, options);
  if (!source) return source.error();
  SampleStream stream(raster, std::move(*source));
  if (const auto skipped = stream.source_.skip(raster.stream_skip); !skipped)
    return skipped.error();
  return stream;
}

Error SampleStream::ends_early() const {
  return bad_input(raster_.file,
                   "ends too early: its header promises {} samples but only {} are there; copy or "
                   "export it again",
                   raster_.sample_count(), position_);
}

Status SampleStream::read(float* to, size_t n) {
  if (raster_.encoding == Encoding::kText) return read_text(to, n);
  const size_t width = bytes_of(raster_.type);
  const bool plain = is_plain_float(raster_);
  if (!plain) bytes_.resize(kChunkSamples * width);
  for (size_t done = 0; done < n;) {
    const size_t count = plain ? n - done : std::min(n - done, kChunkSamples);
    char* const bytes = plain ? reinterpret_cast<char*>(to + done) : bytes_.data();
    const auto got = source_.read(bytes, count * width);
    if (!got) return got.error();
    position_ += *got / width;
    if (*got < count * width) return ends_early();
    if (!plain) convert(bytes, count, raster_, to + done);
    done += count;
  }
  return Nothing{};
}

Status SampleStream::read_text(float* to, size_t n) {
  constexpr std::string_view kSeparators = " \t\r\n,";
  for (size_t done = 0; done < n;) {
    const size_t begin = std::min(text_.find_first_not_of(kSeparators), text_.size());
    const size_t end = text_.find_first_of(kSeparators, begin);
    if (end == std::string::npos && !text_ended_) {
      // The last word may go on in the bytes to come.
      text_.erase(0, begin);
      const size_t decoded = text_.size();
      text_.resize(decoded + kChunkSamples);
      const auto got = source_.read(text_.data() + decoded, kChunkSamples);
      if (!got) return got.error();
      text_.resize(decoded + *got);
      text_ended_ = *got == 0;
      continue;
    }
    // Words are taken out of the middle of the buffer; it is shortened once, when it is used up.
    size_t at = begin;
    for (; done < n && at < text_.size(); ++done, ++position_) {
      const size_t stop = text_.find_first_of(kSeparators, at);
      if (stop == std::string::npos && !text_ended_) break;
      const std::string_view word = std::string_view(text_).substr(at, stop - at);
      const auto number = to_number(word);
      if (!number) {
        return bad_input(raster_.file,
                         "holds '{}' where sample {} should be a number: save the file again",
                         word.substr(0, 20), position_);
      }
      to[done] = float(raster_.slope * *number + raster_.intercept);
      at = std::min(text_.find_first_not_of(kSeparators, std::min(stop, text_.size())),
                    text_.size());
    }
    text_.erase(0, at);
    if (done < n && text_.empty() && text_ended_) return ends_early();
  }
  return Nothing{};
}

Status SampleStream::skip(uint64_t n) {
  if (raster_.encoding != Encoding::kText) {
    const auto skipped = source_.skip(n * bytes_of(raster_.type));
    if (!skipped) return skipped.error();
    position_ += *skipped / bytes_of(raster_.type);
    if (*skipped < n * bytes_of(raster_.type)) return ends_early();
    return Nothing{};
  }
  std::vector<float> bin(size_t(std::min<uint64_t>(n, kChunkSamples)));
  for (uint64_t done = 0; done < n; done += bin.size()) {
    const size_t count = size_t(std::min<uint64_t>(n - done, bin.size()));
    if (const Status read_ok = read(bin.data(), count); !read_ok) return read_ok;
  }
  return Nothing{};
}

Status SampleStream::read_lanes(const std::vector<float*>& lanes, size_t stride) {
  const size_t inner = raster_.inner;
  const size_t outer = raster_.grid.count() / inner;
  const size_t block = inner * lanes.size();
  // Many small blocks are read at a time, a large one is read in pieces.
  std::vector<float> bin(block < kChunkSamples ? kChunkSamples / block * block
                                               : std::min(inner, kChunkSamples));
  if (block < kChunkSamples) {
    for (size_t o = 0; o < outer;) {
      const size_t blocks = std::min(outer - o, bin.size() / block);
      if (const Status got = read(bin.data(), blocks * block); !got) return got;
      const float* from = bin.data();
      for (size_t b = 0; b < blocks; ++b, ++o) {
        for (float* lane : lanes) {
          for (size_t i = 0; i < inner; ++i) lane[(o * inner + i) * stride] = *from++;
        }
      }
    }
    return Nothing{};
  }
  for (size_t o = 0; o < outer; ++o) {
    for (float* lane : lanes) {
      for (size_t i = 0; i < inner;) {
        const size_t count = std::min(inner - i, bin.size());
        if (const Status got = read(bin.data(), count); !got) return got;
        for (size_t c = 0; c < count; ++c, ++i) lane[(o * inner + i) * stride] = bin[c];
      }
    }
  }
  return Nothing{};
}

Status check_finite(const std::filesystem::path& file, size_t frame, const Grid& grid,
                    const float* values, size_t components) {
  const size_t n = grid.count() * components;
  // The exponent of NaN and of Inf is all ones; counting bits is one vectorised pass.
  const auto is_bad = [&](size_t i) {
    return (std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) == 0x7f800000u;
  };
  size_t bad = 0;
  for (size_t i = 0; i < n; ++i) bad += is_bad(i);
  if (bad == 0) return Nothing{};
  size_t first = 0;
  while (!is_bad(first)) ++first;
  const size_t voxel = first / components;
  const size_t nx = size_t(grid.size.x), ny = size_t(grid.size.y);
  Error error = bad_input(file,
                          "holds {} values that are not finite (NaN or Inf) in frame {}, the first "
                          "at voxel ({}, {}, {}): "
                          "replace them, for example by the background value",
                          bad, frame, voxel % nx, voxel / nx % ny, voxel / (nx * ny));
  if (components == 1) error.kind = ErrorKind::kNotFinite;
  return error;
}

}  // namespace palpate::files
