#pragma once

#include "module/scene/scene_spec.h"

namespace palpate {

/// The transform of a volume after time_s (s) of its drive, from its start. With a second hand and
/// without a drive it stays at the start. Any thread; real-time safe. Keys need to have passed
/// check().
Transform driven(const DriveSpec& drive, const Transform& start, double time_s) noexcept;

/// kBadInput, in one sentence, for a drive that can not be followed: numbers that are not finite,
/// and of keys those that do not rise within 0 to 1, values that are missing or no transforms, a
/// cycle that is not above 0. Also transforms that would shear what is within them (a scale that
/// differs between axes with a rotation further inside). Any thread.
Status check(const DriveSpec& drive, const Transform& start);

}  // namespace palpate
