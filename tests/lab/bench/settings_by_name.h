#pragma once

#include <string>

#include "compute/motion/options.h"

namespace palpate::bench {

/// Changes options as a text says: "NAME=NUMBER NAME=NUMBER ...". Names are those of MotionOptions;
/// those of LevelOptions carry the level at their end ("window0" is the finest level's). Throws
/// Mismatch with a sentence for a name that is unknown or a number that can not be read.
void change(MotionOptions& options, const std::string& settings);

}  // namespace palpate::bench
