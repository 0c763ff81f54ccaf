#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "integration/files/atomic_file.h"

namespace palpate::files {

/// Writes an MCAP file (https://mcap.dev/spec): timed messages in channels, as ROS 2 bags and
/// Foxglove read them. Profile "ros2"; messages in CDR, schemas as ros2msg texts. Chunks without
/// compression, an index of them, and a CRC of each chunk, of the data and of the summary. The file
/// appears whole or not at all. One thread.
class McapWriter {
 public:
  /// kBadOutput if the file can not be written there.
  static Result<McapWriter> create(const std::filesystem::path& path);
  /// Before the first message. Returns the channel's number. Channels with the same schema name
  /// share it.
  uint16_t add_channel(std::string_view topic, std::string_view schema, std::string_view text);
  /// Adds a message; times may come in any order. kBadOutput: the disk is full or fails.
  Status write(uint16_t channel, uint64_t time_ns, std::string_view message);
  /// Ends the file. Without it nothing stays behind. kBadOutput.
  Status finish();

 private:
  /// What the summary says of a chunk.
  struct McapChunk {
    uint64_t start_ns, end_ns, at, length, index_length, bytes;
    std::map<uint16_t, uint64_t> index_at;
  };
  struct MessageAt {
    uint64_t time_ns, at;
  };

  explicit McapWriter(AtomicFile file) : file_(std::move(file)) {}
  Status put(std::string_view bytes);
  Status write_chunk();

  AtomicFile file_;
  uint64_t at_ = 0;                 ///< bytes written
  uint32_t crc_ = 0;                ///< of them
  std::string schemas_, channels_;  ///< their records
  std::vector<std::string> schema_names_;
  std::vector<uint64_t> counts_;                         ///< messages of each channel
  std::string chunk_;                                    ///< records that are not written yet
  std::map<uint16_t, std::vector<MessageAt>> in_chunk_;  ///< its messages
  std::vector<McapChunk> chunks_;
};

/// A message in CDR, little-endian, as ROS 2 serializes it.
class CdrMessage {
 public:
  CdrMessage() : bytes_("\0\1\0\0", 4) {}
  CdrMessage& number(double value);
  CdrMessage& whole(uint32_t value);
  CdrMessage& text(std::string_view value);
  const std::string& bytes() const { return bytes_; }

 private:
  void align(size_t to);
  std::string bytes_;
};

}  // namespace palpate::files
