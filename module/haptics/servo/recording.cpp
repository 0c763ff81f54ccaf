#include "module/haptics/servo/recording.h"

#include <algorithm>
#include <cassert>
#include <fstream>
#include <iterator>

#include "compute/volume/open_file.h"
#include "module/haptics/servo/tick_bytes.h"

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kPause{20};
constexpr size_t kFooter = 1 + 3 * sizeof(uint64_t);

/// Whether the bytes end as finish() ends a file: then a tick that reaches beyond the end was
/// damaged, not cut off. The chance that the middle of a tick looks like this is below 1e-12.
bool has_end(std::string_view all) {
  if (all.size() < kFooter) return false;
  FieldDecoder decoder{all, all.size() - kFooter};
  return decoder.whole<uint8_t>() == 'E' && decoder.whole<uint64_t>() < all.size();
}

std::string name_of_field_at(const TickOutput& output, size_t byte) {
  std::string name, bytes;
  const auto count = [&](const char* field, const char* unit, const auto& value) {
    if (bytes.size() <= byte) name = field;
    FieldEncoder{bytes}(field, unit, value);
  };
  visit_output(output, count);
  visit_torque(output, count);
  return name;
}

}  // namespace

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& path,
                                                std::string_view scene, int64_t period_ns) {
  if (scene.size() > kLongestScene)
    return Error{ErrorKind::kBadInput,
                 "The scene's description is too long for a recording: keep it below 1 MiB."};
  RecordingWriter writer;
  writer.path_ = path;
  writer.hash_ = kEmptyHash;
  writer.file_.reset(open_file(path, "wb"));
  if (!writer.file_)
    return Error{ErrorKind::kBadOutput,
                 path.string() + ": the recording can not be written there: choose another place."};
  std::string header(kRecordingMagic);
  FieldEncoder encoder{header};
  encoder.whole(kRecordingVersion);
  encoder.whole(uint32_t(scene.size()));
  header += scene;
  encoder.whole(period_ns);
  writer.put(header);
  return writer;
}

void RecordingWriter::put(std::string_view bytes) {
  hash_ = hash_on(hash_, bytes);
  failed_ |= std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size();
}

void RecordingWriter::hear(const TickInput& input, const TickOutput& output) noexcept {
  buffer_.clear();
  encode_tick(input, output, buffer_);
  put(buffer_);
  ++ticks_;
}

Status RecordingWriter::finish(uint64_t lost) {
  assert(file_);
  std::string footer = "E";
  FieldEncoder encoder{footer};
  encoder.whole(ticks_);
  encoder.whole(lost);
  put(footer);
  footer.clear();
  encoder.whole(hash_);
  put(footer);
  failed_ |= std::fclose(file_.release()) != 0;
  if (failed_)
    return Error{ErrorKind::kBadOutput,
                 path_.string() + ": the recording is not complete: the disk may be full."};
  return Nothing{};
}

TickRecorder::TickRecorder(std::optional<RecordingWriter> writer,
                           std::vector<TickListener*> listeners)
    : writer_(std::move(writer)),
      listeners_(std::move(listeners)),
      background_(std::make_unique<Background>(kPause, [this] { drain(); })) {}

Result<std::unique_ptr<TickRecorder>> TickRecorder::start(const std::filesystem::path& path,
                                                          std::string_view scene, int64_t period_ns,
                                                          std::vector<TickListener*> listeners) {
  auto writer = RecordingWriter::create(path, scene, period_ns);
  if (!writer) return writer.error();
  return std::unique_ptr<TickRecorder>(new TickRecorder(std::move(*writer), std::move(listeners)));
}

void TickRecorder::hear(const TickInput& input, const TickOutput& output) noexcept {
  if (ring_.push({input, output})) heard_.fetch_add(1, std::memory_order_relaxed);
}

void TickRecorder::drain() {
  HeardTick tick;
  while (ring_.pop(tick)) {
    if (writer_) writer_->hear(tick.input, tick.output);
    for (TickListener* listener : listeners_) listener->hear(tick.input, tick.output);
    passed_.fetch_add(1, std::memory_order_relaxed);
  }
}

Status TickRecorder::finish() {
  assert(background_ && "a recording ends once");
  background_.reset();  // drains what is left
  return writer_ ? writer_->finish(ring_.dropped()) : Nothing{};
}

Result<Recording> Recording::read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::error_code ignored;
  if (!file || std::filesystem::is_directory(path, ignored))
    return Error{ErrorKind::kBadInput,
                 path.string() + ": there is no such file that can be read: check the name."};
  std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  return parse(path.string(), std::move(bytes));
}

Result<Recording> Recording::parse(const std::string& name, std::string bytes) {
  const auto refuse = [&](const std::string& sentence) {
    return Error{ErrorKind::kBadInput, name + ": " + sentence};
  };
  const auto cut_off = [&] {
    return refuse("the recording is cut off before its first tick: record again.");
  };
  const auto damaged = [&] { return refuse("the recording is damaged: take another copy of it."); };
  if (!bytes.starts_with(
          kRecordingMagic.substr(0, std::min(bytes.size(), kRecordingMagic.size()))) ||
      bytes.empty())
    return refuse("this is no recording of palpate: give the recording of a session.");

  Recording recording;
  recording.bytes_ = std::move(bytes);
  const std::string_view all = recording.bytes_;
  FieldDecoder decoder{all, std::min(all.size(), kRecordingMagic.size())};
  const auto version = decoder.whole<uint32_t>();
  if (decoder.good && (version < kOldestRecording || version > kRecordingVersion))
    return refuse("the recording is of version " + std::to_string(version) +
                  ", this program reads " + std::to_string(kOldestRecording) + " to " +
                  std::to_string(kRecordingVersion) + ": use the program that made it.");
  recording.version_ = version;
  const auto scene_size = decoder.whole<uint32_t>();
  if (!decoder.good || all.size() - decoder.at < scene_size) return cut_off();
  recording.scene_ = all.substr(decoder.at, scene_size);
  decoder.at += scene_size;
  decoder("", "", recording.period_ns_);
  recording.first_ = recording.at_ = decoder.at;

  TickInput input;
  TickOutput output;
  uint64_t found = 0;
  if (!decoder.good) return cut_off();
  // A process that was killed leaves whole ticks and a part of the last one: those are read.
  const auto as_far_as = [&](size_t end) -> Result<Recording> {
    if (has_end(all)) return damaged();
    if (found == 0) return cut_off();
    recording.end_ = end;
    recording.ticks_ = found;
    recording.is_cut_off_ = true;
    return recording;
  };
  for (; decoder.at < all.size() && all[decoder.at] == 'T'; ++found) {
    const size_t tick = decoder.at++;
    if (decode_tick(decoder, version, input, output)) continue;
    if (decoder.good) return damaged();
    return as_far_as(tick);
  }
  if (decoder.at == all.size()) return as_far_as(decoder.at);
  if (all[decoder.at] != 'E') return damaged();
  if (all.size() - decoder.at < kFooter) return as_far_as(decoder.at);
  if (all.size() - decoder.at > kFooter) return damaged();
  recording.end_ = decoder.at++;
  decoder("", "", recording.ticks_);
  decoder("", "", recording.lost_);
  const uint64_t hash = hash_on(kEmptyHash, all.substr(0, decoder.at));
  if (decoder.whole<uint64_t>() != hash || recording.ticks_ != found) return damaged();
  return recording;
}

bool Recording::next(TickInput& input, TickOutput& output) {
  if (at_ >= end_) return false;
  FieldDecoder decoder{bytes_, at_ + 1};
  decode_tick(decoder, version_, input, output);  // was looked at in parse()
  at_ = decoder.at;
  return true;
}

Result<Replay> replay(Recording& recording, Ticker& ticker, TickListener* listener) {
  if (recording.lost() > 0)
    return Error{ErrorKind::kBadInput,
                 "The recording lacks " + std::to_string(recording.lost()) +
                     " ticks, so it can not be done again: record on a less busy machine."};
  Replay result;
  result.cut_off = recording.is_cut_off();
  recording.rewind();
  TickInput input;
  TickOutput recorded;
  std::string was, is;
  for (; recording.next(input, recorded); ++result.ticks) {
    const TickOutput output = ticker.tick(input);
    if (listener) listener->hear(input, output);
    was.clear();
    is.clear();
    const auto encode = [](const TickOutput& of, std::string& bytes) {
      visit_output(of, FieldEncoder{bytes});
      visit_torque(of, FieldEncoder{bytes});
    };
    encode(recorded, was);
    encode(output, is);
    if (was == is) continue;
    if (result.different++ > 0) continue;
    result.first_different = int64_t(result.ticks);
    const auto differs = std::mismatch(was.begin(), was.end(), is.begin()).first - was.begin();
    result.first_field = name_of_field_at(recorded, size_t(differs));
  }
  return result;
}

}  // namespace palpate
