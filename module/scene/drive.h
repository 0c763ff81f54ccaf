#pragma once

#include "module/scene/scene.h"

namespace palpate {

/// Where a volume that a scene turns or swings by itself is after time_s (s), from where it
/// started. A second hand's volume and a still one stay at the start. Any thread; real-time safe.
Transform driven(const DriveSpec& drive, const Transform& start, double time_s) noexcept;

}  // namespace palpate
