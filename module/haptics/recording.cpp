#include "module/haptics/recording.h"

#include <cassert>

#include "module/haptics/tick_bytes.h"

namespace palpate {

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& path,
                                                std::string_view scene, int64_t period_ns) {
  if (scene.size() > kLongestScene)
    return Error{ErrorKind::kBadInput,
                 "The scene's description is too long for a recording: keep it below 1 MiB."};
  RecordingWriter writer;
  writer.path_ = path;
  writer.hash_ = kEmptyHash;
  writer.file_.reset(std::fopen(path.c_str(), "wb"));
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

void RecordingWriter::add(const TickInput& input, const TickOutput& output) {
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

Result<std::unique_ptr<Recorder>> Recorder::start(const std::filesystem::path& path,
                                                  std::string_view scene, int64_t period_ns) {
  auto writer = RecordingWriter::create(path, scene, period_ns);
  if (!writer) return writer.error();
  std::unique_ptr<Recorder> recorder(new Recorder(std::move(*writer)));
  recorder->background_ = std::make_unique<Background>(std::chrono::milliseconds(20),
                                                       [raw = recorder.get()] { raw->drain(); });
  return recorder;
}

void Recorder::hear(const TickInput& input, const TickOutput& output) noexcept {
  ring_.push({input, output});
}

void Recorder::drain() {
  Entry entry;
  while (ring_.pop(entry)) writer_.add(entry.input, entry.output);
}

Status Recorder::finish() {
  assert(background_ && "a recording ends once");
  background_.reset();  // drains what is left
  return writer_.finish(ring_.dropped());
}

}  // namespace palpate
