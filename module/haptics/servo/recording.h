#pragma once

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/servo/background.h"
#include "module/haptics/servo/mailbox.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate {

/// The file of a recording, version 3; all numbers little-endian, floating point as IEEE 754 bits,
/// fields in the order of tick_fields.h without gaps:
///   "palpate-ticks\r\n\x1a", u32 version, u32 length and text that identifies the scene, i64
///   period (ns); per tick 'T', u8 poses, u8 events, the input's fields, the poses, the events, how
///   the grip is held, the output's fields, the torque; at the end 'E', u64 ticks, u64 ticks that
///   were lost, u64 FNV-1a hash of all bytes before.
/// About 300 bytes per tick: 1.1 GB per hour at 1 kHz. Version 1 has nothing of the grip, 1 and 2
/// no torque; they are read.

/// Writes one. Not real-time safe, one thread.
class RecordingWriter final : public TickListener {
 public:
  static Result<RecordingWriter> create(const std::filesystem::path& path, std::string_view scene,
                                        int64_t period_ns);
  void hear(const TickInput& input, const TickOutput& output) noexcept override;
  /// Writes the end. Without it the file counts as cut off: it can still be read as far as it goes.
  /// kBadOutput if anything could not be written.
  Status finish(uint64_t lost);

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void put(std::string_view bytes);
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::filesystem::path path_;
  std::string buffer_;
  uint64_t ticks_ = 0, hash_ = 0;
  bool failed_ = false;
};

/// Takes the ticks of a Servo off its thread: give it to the Servo as a listener. The servo thread
/// writes into a ring of 4,096 ticks; a thread of its own passes them on, in order, to listeners
/// that need not be real-time safe: a recording, a BlackBox, a table. What does not fit is lost,
/// and counted: the loop never waits. Must live longer than the Servo, and its listeners longer
/// than it.
class TickRecorder : public TickListener {
 public:
  explicit TickRecorder(std::vector<TickListener*> listeners)
      : TickRecorder(std::nullopt, std::move(listeners)) {}
  /// The same with a recording in a file. kBadInput, kBadOutput.
  static Result<std::unique_ptr<TickRecorder>> start(const std::filesystem::path& path,
                                                     std::string_view scene, int64_t period_ns,
                                                     std::vector<TickListener*> listeners = {});
  /// Real-time safe.
  void hear(const TickInput& input, const TickOutput& output) noexcept override;
  /// After the Servo has stopped, once: passes on what is left, and writes the end of the
  /// recording. Without it that counts as cut off. kBadOutput if it could not be written.
  Status finish();
  uint64_t lost() const { return ring_.dropped(); }
  /// How many ticks were heard and are not passed on yet. Any thread.
  uint64_t waiting() const noexcept { return heard_.load() - passed_.load(); }

 private:
  TickRecorder(std::optional<RecordingWriter> writer, std::vector<TickListener*> listeners);
  void drain();

  std::optional<RecordingWriter> writer_;
  std::vector<TickListener*> listeners_;
  Ring<HeardTick, 4096> ring_;
  std::atomic<uint64_t> heard_{0}, passed_{0};
  std::unique_ptr<Background> background_;
};

/// A recording that was read and checked completely. Of one that was cut off it has all whole
/// ticks.
class Recording {
 public:
  /// kBadInput with one sentence: not there, not a recording, of another version, cut off before
  /// its first tick, damaged.
  static Result<Recording> read(const std::filesystem::path& path);
  /// The same of bytes; `name` stands in the sentences.
  static Result<Recording> parse(const std::string& name, std::string bytes);

  const std::string& scene() const { return scene_; }
  int64_t period_ns() const { return period_ns_; }
  uint64_t ticks() const { return ticks_; }
  uint64_t lost() const { return lost_; }  ///< if not 0, a replay can not give the same bits
  /// It was not ended properly: ticks after the last one are missing.
  bool is_cut_off() const { return is_cut_off_; }
  /// The next tick; false at the end.
  bool next(TickInput& input, TickOutput& output);
  void rewind() { at_ = first_; }

 private:
  std::string bytes_, scene_;
  uint32_t version_ = 0;
  int64_t period_ns_ = 0;
  uint64_t ticks_ = 0, lost_ = 0;
  bool is_cut_off_ = false;
  size_t first_ = 0, at_ = 0, end_ = 0;
};

/// What doing a recording again gave.
struct Replay {
  uint64_t ticks = 0;
  bool cut_off = false;    ///< the recording ends before the run did
  uint64_t different = 0;  ///< ticks whose output was not the recorded one, bit by bit
  int64_t first_different = -1;
  std::string first_field;  ///< name of the first field that differed
};

/// Feeds every input to the ticker, in order, and compares its outputs with the recorded ones.
/// kBadInput if ticks were lost while recording. `hear` (may be null) gets each input and the new
/// output.
Result<Replay> replay(Recording& recording, Ticker& ticker, TickListener* listener = nullptr);

}  // namespace palpate
