#pragma once

#include "integration/app/program.h"

namespace palpate::app {

/// `palpate-lab chart`: speed against accuracy, of palpate and its peers.
Command add_chart(CLI::App& program);
/// `palpate-lab maps`: where methods fail.
Command add_maps(CLI::App& program);

}  // namespace palpate::app
