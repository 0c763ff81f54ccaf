#pragma once

#include "integration/app/program.h"

namespace palpate::app {

/// Each adds itself to the program. One file per command.
Command add_calibrate(CLI::App& program);
Command add_motion(CLI::App& program);
Command add_chart(CLI::App& program);
Command add_check(CLI::App& program);
Command add_convert(CLI::App& program);
Command add_devices(CLI::App& program);
Command add_demo(CLI::App& program);
Command add_feel(CLI::App& program);
Command add_info(CLI::App& program);
Command add_plan(CLI::App& program);
Command add_phantom(CLI::App& program);
Command add_serve(CLI::App& program);
/// Not listed in --help: writes the manual pages and completions that are installed.
Command add_write_manual(CLI::App& program);
Command add_view(CLI::App& program);

}  // namespace palpate::app
