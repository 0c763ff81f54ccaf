#include "integration/files/raster/byte_source.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "integration/files/descriptor.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

/// Large enough that system calls do not count, small enough to stay in the second-level cache.
constexpr size_t kPackedBytes = 256 * 1024;

/// zlib's code for "zlib or gzip header, whichever is there".
constexpr int kAnyDeflateHeader = 15 + 32;

constexpr std::string_view kHexDigits = "0123456789abcdef0123456789ABCDEF";

class FileDescriptor {
 public:
  FileDescriptor() = default;
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() { reset(-1); }
  void reset(int fd) {
    if (fd_ >= 0) close_descriptor(fd_);
    fd_ = fd;
  }
  int get() const { return fd_; }

 private:
  int fd_ = -1;
};

}  // namespace

struct ByteSource::State {
  std::vector<std::filesystem::path> paths;
  Options options;
  size_t next_path = 0;
  FileDescriptor fd;
  bool inflating = false;
  std::vector<char> digits;
  int high_digit = -1;  ///< of hexadecimal text, read before its low one; -1: none
  bool stream_ended = false;
  z_stream stream{};
  std::vector<Bytef> packed;

  ~State() {
    if (inflating) inflateEnd(&stream);
  }

  const std::filesystem::path& path() const { return paths[next_path - 1]; }

  Error cannot_read() const {
    return bad_input(path(), "can not be read ({}): check the disk and the permissions",
                     std::strerror(errno));
  }

  Status skip_lines() {
    uint64_t left = options.line_skip;
    char c = 0;
    while (left > 0) {
      const int64_t got = read_some(fd.get(), &c, 1);
      if (got < 0) return cannot_read();
      if (got == 0)
        return bad_input(path(), "ends before its samples start: copy or export it again");
      if (c == '\n') --left;
    }
    return Nothing{};
  }

  Status open_next() {
    const std::filesystem::path& next = paths[next_path++];
    fd.reset(open_to_read(next));
    if (fd.get() < 0)
      return bad_input(next, "can not be opened ({}): check its name and the permissions",
                       std::strerror(errno));
    expect_in_order(fd.get());
    const bool from_end = options.last_bytes > 0;
    const int64_t step = from_end ? -int64_t(options.last_bytes) : int64_t(options.file_skip);
    if (!seek(fd.get(), step, from_end ? SeekFrom::kEnd : SeekFrom::kStart)) return cannot_read();
    if (const Status lines = skip_lines(); !lines) return lines;
    return Nothing{};
  }

  /// Packed or plain bytes as they lie in the files; 0 only at the very end.
  Result<size_t> read_plain(void* to, size_t n) {
    size_t done = 0;
    while (done < n) {
      const int64_t got = read_some(fd.get(), static_cast<char*>(to) + done, n - done);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return cannot_read();
      done += size_t(got);
      if (got == 0) {
        if (next_path == paths.size()) break;
        if (const Status opened = open_next(); !opened) return opened.error();
      }
    }
    return done;
  }

  /// Two hexadecimal digits per byte; white space may stand anywhere.
  Result<size_t> read_hex(void* to, size_t n) {
    auto* const bytes = static_cast<unsigned char*>(to);
    for (size_t done = 0; done < n;) {
      digits.resize(std::min(2 * (n - done), kPackedBytes));
      const auto got = read_plain(digits.data(), digits.size());
      if (!got) return got.error();
      if (*got == 0) return done;
      for (const char c : std::string_view(digits.data(), *got)) {
        if (c == ' ' || (c >= '\t' && c <= '\r')) continue;
        const size_t place = kHexDigits.find(c);
        if (place == std::string_view::npos)
          return bad_input(path(), "holds '{}' where a hexadecimal digit should be: save it again",
                           c);
        const int value = int(place % 16);
        if (high_digit < 0) {
          high_digit = value;
          continue;
        }
        bytes[done++] = static_cast<unsigned char>(16 * high_digit + value);
        high_digit = -1;
      }
    }
    return n;
  }

  /// Packed bytes until there are at least `least` of them, fewer only at the very end. What is
  /// left of the buffer moves to its start.
  Status fill(size_t least) {
    if (stream.avail_in >= least) return Nothing{};
    std::memmove(packed.data(), stream.next_in, stream.avail_in);
    const auto got = read_plain(packed.data() + stream.avail_in, packed.size() - stream.avail_in);
    if (!got) return got.error();
    stream.next_in = packed.data();
    stream.avail_in += uInt(*got);
    return Nothing{};
  }

  /// Whether another member of a gzip file follows; anything else behind the stream is not ours.
  /// Its first bytes may lie in the buffer, in the file, or on both sides of the border.
  Result<bool> another_member() {
    if (const Status filled = fill(2); !filled) return filled.error();
    return stream.avail_in >= 2 && stream.next_in[0] == 0x1f && stream.next_in[1] == 0x8b;
  }

  Result<size_t> read_inflated(void* to, size_t n) {
    stream.next_out = static_cast<Bytef*>(to);
    size_t done = 0;
    while (done < n && !stream_ended) {
      if (const Status filled = fill(1); !filled) return filled.error();
      if (stream.avail_in == 0) break;
      const uInt room = uInt(std::min<size_t>(n - done, 1u << 30));
      stream.avail_out = room;
      const int code = inflate(&stream, Z_NO_FLUSH);
      done += room - stream.avail_out;
      if (code == Z_STREAM_END) {
        const auto another = another_member();
        if (!another) return another.error();
        stream_ended = !*another || inflateReset(&stream) != Z_OK;
      } else if (code != Z_OK && code != Z_BUF_ERROR) {
        return bad_input(
            path(),
            "is damaged: its compressed samples can not be unpacked; copy or export it again");
      }
    }
    return done;
  }
};

ByteSource::ByteSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource& ByteSource::operator=(ByteSource&&) noexcept = default;
ByteSource::~ByteSource() = default;

Result<ByteSource> ByteSource::open(std::vector<std::filesystem::path> paths, Options options) {
  auto state = std::make_unique<State>();
  state->paths = std::move(paths);
  state->options = options;
  if (const Status opened = state->open_next(); !opened) return opened.error();
  if (options.deflate) {
    state->packed.resize(kPackedBytes);
    state->stream.next_in = state->packed.data();
    if (inflateInit2(&state->stream, kAnyDeflateHeader) != Z_OK) {
      return Error{ErrorKind::kOutOfMemory,
                   "There is not enough memory to unpack a file: close other programs"};
    }
    state->inflating = true;
  }
  return ByteSource(std::move(state));
}

Result<size_t> ByteSource::read(void* to, size_t n) {
  if (state_->options.hex) return state_->read_hex(to, n);
  return state_->inflating ? state_->read_inflated(to, n) : state_->read_plain(to, n);
}

Result<uint64_t> ByteSource::skip(uint64_t n) {
  // One plain file: only its position changes, and a later read beyond the end tells how much is
  // missing.
  if (!state_->inflating && !state_->options.hex && state_->paths.size() == 1) {
    if (!seek(state_->fd.get(), int64_t(n), SeekFrom::kHere)) return state_->cannot_read();
    return n;
  }
  std::vector<char> bin(size_t(std::min<uint64_t>(n, kPackedBytes)));
  uint64_t done = 0;
  while (done < n) {
    const auto got = read(bin.data(), size_t(std::min<uint64_t>(n - done, bin.size())));
    if (!got) return got.error();
    if (*got == 0) break;
    done += *got;
  }
  return done;
}

}  // namespace palpate::files
