#include "module/haptics/scene_ticker.h"

namespace palpate {

SceneTicker::~SceneTicker() {
  // The handover owns every run, the step only borrows one.
  haptics_.adopt(nullptr).release();
}

bool SceneTicker::offer(std::shared_ptr<const HapticScene> scene) {
  auto run = Haptics::prepare(std::move(scene));
  return handover_.offer(run);
}

TickOutput SceneTicker::tick(const TickInput& input) noexcept {
  if (HapticRun* next = handover_.take())
    handover_.retire(haptics_.adopt(std::unique_ptr<HapticRun>(next)).release());
  return haptics_.tick(input);
}

}  // namespace palpate
