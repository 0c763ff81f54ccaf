#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "integration/app/force_device.h"
#include "integration/app/gpu.h"
#include "integration/scenes/load_scene.h"
#include "module/session/scene_picture.h"

namespace palpate::app {

/// The options of feeling.
struct FeelCommand {
  std::vector<std::filesystem::path> inputs;
  scenes::SequenceChoices sequence;
  ForceDeviceChoice device;
  DeviceOptions gpu;
  std::string preset;  ///< empty: "fast" for a live source, else "balanced"
  std::string scale = "fit";
  double seconds = 0.0;
  double stiffness_n_per_m = 0.0, max_force_n = 0.0;
  double watchdog_ms = 0.0;
  std::filesystem::path csv, picture, record, replay;
  std::filesystem::path tubes;      ///< where the hand's stream tubes are written
  std::filesystem::path black_box;  ///< empty: the state folder
  std::filesystem::path headless;
  ViewChoices view;
  std::string headset = "auto";
  std::string live_image, live_transform;  ///< device names of an OpenIGTLink source
  bool keep_cycles = true;                 ///< of such a source
  std::string tool, tool_name;  ///< a tracked tool that is the hand: igtl://..., and which
  int serve_port = 0;           ///< sends what is felt there; 0: nowhere
  std::string on_headset_loss = "ramp";
  std::filesystem::path calibration;
  int picture_size = 384;
  int core = -1;
  bool servo_report = false;
  bool dead_man = false, no_real_time = false, no_motion = false, estimate = false, quiet = false;
  bool mirror = true;
  bool json = false;  ///< what is served, on stdout, for programs: see docs/openigtlink.md
  bool sound = true;  ///< where a bare finger touches, in a headset
  bool pass_through = false;
  std::optional<uint32_t> overlay;  ///< above another OpenXR program
  bool hand = true;                 ///< false: it is only looked at, as by 'palpate view'
};

/// Feels, or replays, from the first line of output to the summary; returns the exit code. Call on
/// the main thread, before others are started: it handles Ctrl-C and the signals of a crash.
int run_feel(const FeelCommand& command);

/// Not 18944, the usual port of OpenIGTLink, which the other program uses.
constexpr int kServePort = 18945;

/// The options of segmentations and of a scene's folder, which feeling, viewing and planning share.
void add_segments(CLI::App& app, scenes::SequenceChoices& choices);
/// Whose values a sequence has.
void add_values(CLI::App& app, scenes::SequenceChoices& choices);
/// What surface is felt of values. After add_segments().
void add_wall(CLI::App& app, scenes::SequenceChoices& choices);
/// --modes.
void add_modes(CLI::App& app, scenes::SequenceChoices& choices);

/// The options of an OpenIGTLink source.
void add_live(CLI::App& app, FeelCommand& command);

/// Where it is seen: options that feeling and viewing share.
void add_seeing(CLI::App& app, FeelCommand& command);

}  // namespace palpate::app
