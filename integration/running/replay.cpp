#include "integration/running/replay.h"

#include <fmt/format.h>

#include "integration/files/sentences.h"
#include "integration/loading/mode_library.h"
#include "integration/loading/replay_key.h"
#include "module/haptics/scene/scene.h"
#include "module/haptics/scene_ticker.h"

namespace palpate::running {
namespace {

/// Executes the commands of the hand in each tick.
class CommandTaker final : public TickListener {
 public:
  CommandTaker(SceneTicker& ticker, const Scene& scene, HandTubes& tubes)
      : ticker_(ticker), scene_(scene), tubes_(tubes) {}
  void hear(const TickInput&, const TickOutput&) noexcept override {
    HandCommand command;
    // Errors were reported when the run was recorded.
    while (ticker_.next_command(command)) (void)tubes_.take(command, scene_);
  }

 private:
  SceneTicker& ticker_;
  const Scene& scene_;
  HandTubes& tubes_;
};

}  // namespace

Result<Replay> replay_felt(const LoadedScene& felt, const std::filesystem::path& file,
                           HandTubes& tubes) {
  auto recording = Recording::read(file);
  if (!recording) return recording.error();
  const auto key =
      loading::parse_replay_key(file, recording->scene(), loading::added_kinds(felt.kinds));
  if (!key) return key.error();
  const SceneSpec& spec = key->scene;
  bool same = spec.volumes.size() == felt.spec.volumes.size();
  for (size_t v = 0; same && v < spec.volumes.size(); ++v)
    same = spec.volumes[v].name == felt.spec.volumes[v].name;
  if (!same)
    return files::bad_input(file, "was made with another scene: name the scene that was felt");
  // The recorded scene, with its places and stiffness, on the data that are loaded now.
  auto assembled = plan(spec, felt.data, felt.kinds);
  if (!assembled) return assembled.error();
  HapticsOptions options;
  options.safety = key->safety;
  SceneTicker ticker(options, key->device);
  ticker.take_buttons(key->tube_buttons);
  ticker.offer(*assembled);
  CommandTaker taker(ticker, **assembled, tubes);
  return replay(*recording, ticker, &taker);
}

std::string replay_text(const Replay& replay) {
  const char* cut_off = replay.cut_off ? "; the recording is cut off there" : "";
  if (replay.different == 0)
    return fmt::format("every output is the recorded one, bit by bit{}", cut_off);
  return fmt::format(
      "{} outputs differ, the first in tick {} in its {}: other data, or another build?{}",
      replay.different, replay.first_different, replay.first_field, cut_off);
}

}  // namespace palpate::running
