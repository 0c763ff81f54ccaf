// The frames of files, for a program.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "integration/files/raster/raster.h"
#include "integration/files/read_sequence.h"
#include "integration/toolkit/handles.h"

namespace palpate::toolkit {

/// The content of a PalSequence.
struct SequenceContent {
  files::SequenceReader reader;
  std::string notes;
  std::mutex reading;  ///< guards reader.frame()
};

static Handle<SequenceContent>* of(PalSequence* handle) noexcept {
  return reinterpret_cast<Handle<SequenceContent>*>(handle);
}
static Handle<SequenceContent>* of(const PalSequence* handle) noexcept {
  return of(const_cast<PalSequence*>(handle));
}

namespace {

PalResult open_sequence(const PalSequenceInfo* given, PalSequence** sequence) {
  if (!sequence) return failed(PAL_BAD_INPUT, {"The argument that takes the sequence is NULL"});
  PalSequenceInfo info;
  if (const PalResult read =
          taken(given, offsetof(PalSequenceInfo, nan_as), "PalSequenceInfo", info);
      read != PAL_OK)
    return read;
  if (info.path_count == 0 || !info.paths)
    return failed(PAL_BAD_INPUT, {"A sequence needs a path"});
  std::vector<std::filesystem::path> paths;
  for (uint32_t k = 0; k < info.path_count; ++k) {
    if (!info.paths[k]) return failed(PAL_BAD_INPUT, {"A path of the sequence is NULL"});
    paths.emplace_back(info.paths[k]);
  }
  auto reader = files::SequenceReader::open(
      paths, info.nan_as ? std::optional<float>(float(*info.nan_as)) : std::nullopt);
  if (!reader) return failed(reader.error());
  auto content = std::make_shared<SequenceContent>(std::move(*reader));
  content->notes = fmt::format("{}", fmt::join(content->reader.notes(), "\n"));
  *sequence = reinterpret_cast<PalSequence*>(Handle<SequenceContent>::make(std::move(content)));
  return PAL_OK;
}

PalResult read_frame(SequenceContent& content, uint32_t index, float* samples, double* time_s) {
  if (index >= content.reader.frame_count()) return PAL_END;
  if (samples) {
    const std::lock_guard lock(content.reading);
    auto frame = content.reader.frame(index);
    if (!frame) return failed(frame.error());
    files::reverse_j(frame->grid, frame->values.data(), 1);
    std::copy(frame->values.begin(), frame->values.end(), samples);
  }
  if (time_s) *time_s = content.reader.times_s()[index];
  return PAL_OK;
}

}  // namespace
}  // namespace palpate::toolkit

using namespace palpate::toolkit;

PalResult pal_sequence_open(const PalSequenceInfo* info, PalSequence** sequence) {
  return guarded([&] { return open_sequence(info, sequence); });
}

PalResult pal_sequence_close(PalSequence** sequence) {
  return guarded([&] {
    closed(of(taken_out_of(sequence)));
    return PAL_OK;
  });
}

PalResult pal_sequence_summary(const PalSequence* sequence, PalSequenceSummary* summary) {
  return guarded([&] {
    const Use use(of(sequence));
    if (!use) return refused_handle("sequence");
    PalSequenceSummary known;
    if (const PalResult read =
            taken(summary, offsetof(PalSequenceSummary, notes), "PalSequenceSummary", known);
        read != PAL_OK)
      return read;
    known.frame_count = uint32_t(use->reader.frame_count());
    known.has_times = use->reader.times_known();
    fill_grid(known.grid, use->reader.grid());
    known.notes = use->notes.c_str();
    std::memcpy(summary, &known, summary->size);
    return PAL_OK;
  });
}

PalResult pal_sequence_frame(PalSequence* sequence, uint32_t index, float* samples,
                             double* time_s) {
  return guarded([&] {
    const Use use(of(sequence));
    if (!use) return refused_handle("sequence");
    return read_frame(*use, index, samples, time_s);
  });
}
