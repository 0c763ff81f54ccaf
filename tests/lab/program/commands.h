#pragma once

#include "integration/app/program.h"

namespace palpate::app {

/// `palpate-lab chart`: speed against accuracy, of palpate and its peers.
Command add_chart(CLI::App& program);
/// `palpate-lab maps`: where methods fail.
Command add_maps(CLI::App& program);
/// `palpate-lab motion`: speed and accuracy of the motion presets.
Command add_motion(CLI::App& program);
/// `palpate-lab anatomies`: the presets on every anatomy with known motion, compared with ITK's
/// Demons.
Command add_anatomies(CLI::App& program);
/// `palpate-lab sequence`, `harmonics`: one motion for a whole sequence, and how smooth it should
/// be.
Command add_sequence(CLI::App& program);
Command add_harmonics(CLI::App& program);
/// `palpate-lab feel`: time, accuracy and stability of the haptic loop.
Command add_feel(CLI::App& program);
/// `palpate-lab view`: the time of pictures.
Command add_view(CLI::App& program);
/// `palpate-lab hearts`: a hand on real beating hearts.
Command add_hearts(CLI::App& program);
/// `palpate-lab soak`: a long run of the main task with all kinds of faults.
Command add_soak(CLI::App& program);

}  // namespace palpate::app
