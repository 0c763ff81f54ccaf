#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "integration/app/force_device.h"
#include "integration/app/gpu.h"
#include "integration/loading/load_scene.h"
#include "module/session/scene_picture.h"

namespace palpate::app {

/// The options of palpate feel and of the commands that share its run.
struct FeelCommand {
  std::vector<std::filesystem::path> inputs;
  loading::SequenceChoices sequence;
  ForceDeviceChoice device;
  DeviceOptions gpu;
  std::string preset;  ///< empty: "fast" for a live source, else "balanced"
  std::string scale = "fit";
  double seconds = 0.0;
  double stiffness_n_per_m = 0.0, max_force_n = 0.0;
  double watchdog_ms = 0.0;
  std::filesystem::path csv, picture, record, replay;
  std::filesystem::path tubes;      ///< output file of the user's stream tubes
  std::filesystem::path black_box;  ///< empty: the state folder
  std::filesystem::path headless;
  ViewChoices view;
  std::string headset = "auto";
  std::string live_image, live_transform;  ///< device names in an OpenIGTLink source
  bool keep_cycles = true;                 ///< for such a source
  bool no_crc = false;                     ///< accept messages without a CRC, also of a tool
  std::string tool, tool_name;  ///< a tracked tool used as the hand: igtl://..., and its name
  int serve_port = 0;           ///< port of the OpenIGTLink server; 0: none
  std::string on_headset_loss = "ramp";
  std::filesystem::path calibration;
  int picture_size = 384;
  int core = -1;
  bool servo_report = false;
  bool dead_man = false, no_real_time = false, no_motion = false, estimate = false, quiet = false;
  bool mirror = true;
  bool json = false;  ///< print what is served on stdout, for programs: see docs/openigtlink.md
  bool sound = true;  ///< sound of contact for a bare finger in a headset
  bool pass_through = false;
  std::optional<uint32_t> overlay;  ///< draw above another OpenXR program
  bool hand = true;                 ///< false: viewing only, as in 'palpate view'
};

/// The address of a live source or a tool, as the options say.
std::string server_address(const FeelCommand& command, const std::string& place);

/// The notes of a scene, for the user of the program: choices that were made, and how to make
/// others.
std::vector<std::string> notes_of(const LoadedScene& scene);

/// Runs or replays a scene, from the first line of output to the summary; returns the exit code.
/// Call it on the main thread, before others are started: it handles Ctrl-C and the signals of a
/// crash.
int run_feel(const FeelCommand& command);

/// Not 18944, the usual port of OpenIGTLink, which the other program uses.
constexpr int kServePort = 18945;

/// Adds --fps.
void add_frame_rate(CLI::App& app, double& frames_per_second);
/// Adds the options of segmentations and of a scene's folder, shared by feel, view and plan.
void add_segments(CLI::App& app, loading::SequenceChoices& choices);
/// Adds the options for the values of a sequence: one frame's, the mean, or each frame's own; and
/// what NaN becomes.
void add_values(CLI::App& app, loading::SequenceChoices& choices);
/// Adds the options for the surface that is felt. After add_segments().
void add_wall(CLI::App& app, loading::SequenceChoices& choices);
/// Adds --modes.
void add_modes(CLI::App& app, loading::SequenceChoices& choices);

/// Adds the options of an OpenIGTLink source.
void add_live(CLI::App& app, FeelCommand& command);

/// Adds the options of the display, shared by feel and view.
void add_seeing(CLI::App& app, FeelCommand& command);

}  // namespace palpate::app
