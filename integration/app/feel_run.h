#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "integration/app/gpu.h"
#include "integration/running/session_request.h"
#include "module/session/scene_picture.h"

namespace palpate::app {

/// The options of palpate feel and of the commands that share its run: the session, and what is
/// seen of it and printed.
struct FeelCommand {
  running::SessionRequest request;  ///< shown_only: viewing only, as in 'palpate view'
  DeviceOptions gpu;
  double seconds = 0.0;
  std::filesystem::path picture, page, replay;
  std::filesystem::path tubes;  ///< output file of the user's stream tubes
  std::filesystem::path headless;
  ViewChoices view;
  std::string headset = "auto";
  std::string on_headset_loss = "ramp";
  std::filesystem::path calibration;
  int picture_size = 384;
  bool servo_report = false, quiet = false;
  bool mirror = true;
  bool json = false;  ///< print what is served on stdout, for programs: see docs/openigtlink.md
  bool sound = true;  ///< sound of contact for a bare finger in a headset
  bool pass_through = false;
  bool panel = true;                ///< text in the headset
  double refresh_hz = 0.0;          ///< of the headset's display; 0: what the pictures can hold
  std::optional<uint32_t> overlay;  ///< draw above another OpenXR program

  bool page_hand = false;  ///< the hand is one in the live page, without a force device

  bool hand() const { return !request.shown_only; }
};

/// The notes of a scene, for the user of the program: choices that were made, and how to make
/// others.
std::vector<std::string> notes_of(const LoadedScene& scene);

/// Runs or replays a scene, from the first line of output to the summary; returns the exit code.
/// Call it on the main thread, before others are started: it handles Ctrl-C and the signals of a
/// crash.
int run_feel(const FeelCommand& command);

/// Not 18944, the usual port of OpenIGTLink, which the other program uses.
constexpr int kServePort = 18945;

/// Adds the options of the display, shared by feel and view.
void add_seeing(CLI::App& app, FeelCommand& command);

}  // namespace palpate::app
