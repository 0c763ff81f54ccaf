#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

namespace palpate::app {

/// A command of the program: its options, and what to do once they are parsed; returns the exit
/// code.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

/// Each adds itself to the program. One file per command.
Command add_calibrate(CLI::App& program);
Command add_motion(CLI::App& program);
Command add_chart(CLI::App& program);
Command add_check(CLI::App& program);
Command add_devices(CLI::App& program);
Command add_demo(CLI::App& program);
Command add_feel(CLI::App& program);
Command add_plan(CLI::App& program);
Command add_phantom(CLI::App& program);
Command add_view(CLI::App& program);

}  // namespace palpate::app
