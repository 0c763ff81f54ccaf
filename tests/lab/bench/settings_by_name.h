#pragma once

#include <string>

#include "compute/motion/options.h"

namespace palpate::bench {

/// Changes options by a text: "NAME=NUMBER NAME=NUMBER ...". Names are those of MotionOptions;
/// those of LevelOptions have the level at their end ("window0" is for the finest level). Throws
/// Mismatch with a message for an unknown name or a number that can not be read.
void change(MotionOptions& options, const std::string& settings);

}  // namespace palpate::bench
