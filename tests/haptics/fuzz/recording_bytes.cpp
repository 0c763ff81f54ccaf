#include "tests/haptics/fuzz/recording_bytes.h"

#include "module/haptics/servo/recording.h"
#include "module/haptics/servo/tick_bytes.h"
#include "tests/support/require.h"

namespace palpate::fuzz {
namespace {

void check(std::string bytes) {
  auto found = Recording::parse("fuzz.ticks", std::move(bytes));
  if (!found) {
    const std::string& sentence = found.error().message;
    require(sentence.starts_with("fuzz.ticks: ") && sentence.ends_with("."), "a sentence");
    return;
  }
  TickInput input;
  TickOutput output;
  uint64_t ticks = 0;
  for (; found->next(input, output); ++ticks) {
    require(input.pose_count >= 0 && input.pose_count <= int(input.poses.size()), "poses fit");
    require(input.event_count >= 0 && input.event_count <= int(input.events.size()), "events fit");
  }
  require(ticks == found->ticks(), "as many ticks as are said");
}

}  // namespace

void parse_recording(std::string_view bytes) {
  check(std::string(bytes));
  if (bytes.size() < sizeof(uint64_t)) return;
  // A mutation never has the right hash by chance: without this repair only the hash check would be
  // tested.
  std::string repaired(bytes.substr(0, bytes.size() - sizeof(uint64_t)));
  const uint64_t hash = hash_on(kEmptyHash, repaired);
  FieldEncoder{repaired}.whole(hash);
  check(std::move(repaired));
}

}  // namespace palpate::fuzz
