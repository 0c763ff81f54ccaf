#include "integration/files/mcap.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>
namespace palpate::files {
namespace {

constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
constexpr size_t kMcapChunkBytes = 1 << 20;

enum class McapRecord : uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kStatistics = 11,
  kSummaryOffset = 14,
  kDataEnd
};

template <class Whole>
void put_whole(std::string& bytes, Whole value) {
  for (size_t k = 0; k < sizeof value; ++k) bytes.push_back(char(value >> (8 * k) & 0xff));
}

/// The content of a record.
struct McapContent {
  std::string bytes;
  template <class Whole>
  McapContent& whole(Whole value) {
    put_whole(bytes, value);
    return *this;
  }
  /// With its length before it.
  McapContent& text(std::string_view value) {
    put_whole(bytes, uint32_t(value.size()));
    bytes += value;
    return *this;
  }
  std::string record(McapRecord kind) const {
    std::string all(1, char(kind));
    put_whole(all, uint64_t(bytes.size()));
    return all + bytes;
  }
};

uint32_t crc_on(uint32_t crc, std::string_view bytes) {
  return uint32_t(crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Where a chunk is, and in it the messages of each channel.
std::string index_record(const auto& chunk) {
  McapContent places;
  for (const auto& [channel, at] : chunk.index_at) places.whole(channel).whole(at);
  return McapContent{}
      .whole(chunk.start_ns)
      .whole(chunk.end_ns)
      .whole(chunk.at)
      .whole(chunk.length)
      .text(places.bytes)
      .whole(chunk.index_length)
      .text("")
      .whole(chunk.bytes)
      .whole(chunk.bytes)
      .record(McapRecord::kChunkIndex);
}

}  // namespace

Result<McapWriter> McapWriter::create(const std::filesystem::path& path) {
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  McapWriter writer(std::move(*file));
  const std::string header = McapContent{}.text("ros2").text("palpate").record(McapRecord::kHeader);
  if (const Status put = writer.put(std::string(kMcapMagic) + header); !put) return put.error();
  return writer;
}

Status McapWriter::put(std::string_view bytes) {
  crc_ = crc_on(crc_, bytes);
  at_ += bytes.size();
  return file_.write(bytes.data(), bytes.size());
}

uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema,
                                 std::string_view text) {
  const auto known = std::find(schema_names_.begin(), schema_names_.end(), schema);
  const auto schema_id = uint16_t(known - schema_names_.begin() + 1);  // 0 is "no schema"
  if (known == schema_names_.end()) {
    schema_names_.emplace_back(schema);
    schemas_ += McapContent{}.whole(schema_id).text(schema).text("ros2msg").text(text).record(
        McapRecord::kSchema);
  }
  const auto channel = uint16_t(counts_.size());
  counts_.push_back(0);
  channels_ += McapContent{}
                   .whole(channel)
                   .whole(schema_id)
                   .text(topic)
                   .text("cdr")
                   .text("")  // no metadata
                   .record(McapRecord::kChannel);
  return channel;
}

Status McapWriter::write(uint16_t channel, uint64_t time_ns, std::string_view message) {
  // Where the first chunk begins, a reader that goes through the file must know the channels.
  if (chunks_.empty() && chunk_.empty()) chunk_ = schemas_ + channels_;
  in_chunk_[channel].push_back({time_ns, chunk_.size()});
  McapContent content;
  content.whole(channel).whole(uint32_t(counts_[channel]++)).whole(time_ns).whole(time_ns);
  content.bytes += message;
  chunk_ += content.record(McapRecord::kMessage);
  if (chunk_.size() < kMcapChunkBytes) return Nothing{};
  return write_chunk();
}

Status McapWriter::write_chunk() {
  if (in_chunk_.empty()) return Nothing{};
  McapChunk chunk{std::numeric_limits<uint64_t>::max(), 0, at_, 0, 0, chunk_.size(), {}};
  for (const auto& [channel, messages] : in_chunk_)
    for (const MessageAt& message : messages) {
      chunk.start_ns = std::min(chunk.start_ns, message.time_ns);
      chunk.end_ns = std::max(chunk.end_ns, message.time_ns);
    }
  McapContent content;
  content.whole(chunk.start_ns)
      .whole(chunk.end_ns)
      .whole(chunk.bytes)
      .whole(crc_on(0, chunk_))
      .text("")  // no compression
      .whole(chunk.bytes);
  content.bytes += chunk_;
  if (const Status written = put(content.record(McapRecord::kChunk)); !written) return written;
  chunk.length = at_ - chunk.at;

  const uint64_t index_at = at_;
  for (const auto& [channel, messages] : in_chunk_) {
    chunk.index_at[channel] = at_;
    McapContent entries;
    for (const MessageAt& message : messages) entries.whole(message.time_ns).whole(message.at);
    const std::string record =
        McapContent{}.whole(channel).text(entries.bytes).record(McapRecord::kMessageIndex);
    if (const Status written = put(record); !written) return written;
  }
  chunk.index_length = at_ - index_at;
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
  in_chunk_.clear();
  return Nothing{};
}

Status McapWriter::finish() {
  if (const Status written = write_chunk(); !written) return written;
  if (const Status written = put(McapContent{}.whole(crc_).record(McapRecord::kDataEnd)); !written)
    return written;

  // The summary: groups of records of one kind, and where each group is.
  const uint64_t summary_at = at_;
  std::string summary, offsets;
  const auto group = [&](McapRecord kind, const std::string& records) {
    if (records.empty()) return;
    offsets += McapContent{}
                   .whole(uint8_t(kind))
                   .whole(summary_at + summary.size())
                   .whole(uint64_t(records.size()))
                   .record(McapRecord::kSummaryOffset);
    summary += records;
  };
  group(McapRecord::kSchema, schemas_);
  group(McapRecord::kChannel, channels_);

  uint64_t messages = 0, start_ns = chunks_.empty() ? 0 : chunks_.front().start_ns, end_ns = 0;
  std::string indices;
  for (const McapChunk& chunk : chunks_) {
    start_ns = std::min(start_ns, chunk.start_ns);
    end_ns = std::max(end_ns, chunk.end_ns);
    indices += index_record(chunk);
  }
  McapContent counts;
  for (size_t channel = 0; channel < counts_.size(); ++channel) {
    messages += counts_[channel];
    counts.whole(uint16_t(channel)).whole(counts_[channel]);
  }
  group(McapRecord::kStatistics, McapContent{}
                                     .whole(messages)
                                     .whole(uint16_t(schema_names_.size()))
                                     .whole(uint32_t(counts_.size()))
                                     .whole(uint32_t(0))  // attachments
                                     .whole(uint32_t(0))  // metadata
                                     .whole(uint32_t(chunks_.size()))
                                     .whole(start_ns)
                                     .whole(end_ns)
                                     .text(counts.bytes)
                                     .record(McapRecord::kStatistics));
  group(McapRecord::kChunkIndex, indices);

  // The footer's CRC is that of the summary and of the footer's bytes before it.
  std::string footer = McapContent{}
                           .whole(summary_at)
                           .whole(summary_at + summary.size())
                           .whole(uint32_t(0))
                           .record(McapRecord::kFooter);
  footer.resize(footer.size() - sizeof(uint32_t));
  std::string end = summary + offsets + footer;
  put_whole(end, crc_on(0, end));
  end += kMcapMagic;
  if (const Status written = put(end); !written) return written;
  return file_.commit();
}

void CdrMessage::align(size_t to) {
  // Counted from behind the four bytes that name the encoding.
  while ((bytes_.size() - 4) % to) bytes_.push_back('\0');
}

CdrMessage& CdrMessage::number(double value) {
  align(8);
  put_whole(bytes_, std::bit_cast<uint64_t>(value));
  return *this;
}

CdrMessage& CdrMessage::whole(uint32_t value) {
  align(4);
  put_whole(bytes_, value);
  return *this;
}

CdrMessage& CdrMessage::text(std::string_view value) {
  whole(uint32_t(value.size() + 1));
  bytes_ += value;
  bytes_.push_back('\0');
  return *this;
}

}  // namespace palpate::files
