#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "integration/loading/load_scene.h"

namespace palpate::running {

/// A session, described once: what is felt, with which device, how the loop runs, what is kept and
/// what is served. Every door (command line, scene file, C library, Python) fills one with
/// set_option(), and open_session() runs it. session_options.h has the table of its options.
struct SessionRequest {
  // What is felt.
  std::vector<std::filesystem::path> inputs;  ///< as for load_scene(), or one igtl://HOST:PORT
  loading::SequenceChoices sequence;          ///< of a sequence without a scene file
  std::optional<double> scale;                ///< of a sequence; empty: fit into the device's reach
  bool true_size = false;                     ///< a sequence keeps its size
  bool movable = false;                       ///< a host may place volumes that nothing else moves
  bool motion = true;                         ///< false: missing motion is forgotten
  bool forget_motion = false;                 ///< also of synthetic data, whose motion is known
  bool shown_only = false;                    ///< nothing is felt: as load_shown_scene()

  // Live frames: inputs is one igtl://HOST:PORT.
  std::string image, transform;  ///< device names there; empty: the first image's, none
  double wait_s = 0.0;           ///< for the first image; 0: without limit
  bool crc = true;               ///< refuse messages without one, of a tool too
  bool follow = false;           ///< every frame, even where they repeat

  // The device.
  std::string device = "auto";            ///< as `device` in the table
  std::string second_device;              ///< another one, for a second hand; empty: none
  std::filesystem::path falcon_firmware;  ///< the user's own file
  std::string tool;                       ///< device name of a tracked tool's transforms
  std::string path = "press";             ///< of the simulated hand
  std::string hand = "human";             ///< how it holds the device
  double lets_go_s = std::numeric_limits<double>::infinity();

  // Loop and safety.
  std::optional<double> stiffness_n_per_m, max_force_n;  ///< empty: the scene's
  std::optional<double> tool_radius_mm;                  ///< empty: the scene's
  int tool_points = 0;                                   ///< 0: the scene's
  std::optional<double> watchdog_s;                      ///< empty: 0.005, harmless hands 0.05
  double max_hand_speed_m_per_s = 1.5;
  bool dead_man = false;
  bool real_time = true;
  int core = -1;              ///< of the servo thread; -1: any
  uint32_t tube_buttons = 0;  ///< bit k: button k of the device lays stream tubes

  // Estimation of missing motion.
  bool estimate = true;
  std::string preset;  ///< empty: "fast" for a live source, else "balanced"

  // What is kept and served.
  std::filesystem::path record, csv;
  std::string black_box;  ///< a folder, "off", or empty: the folder of the user's state
  int serve = 0;          ///< port of the OpenIGTLink server; 0: none
  int web = 0;            ///< port of the live page; 0: none
  std::string web_address = "127.0.0.1";  ///< where the page may be reached from

  std::set<std::string_view> given;  ///< keys of the options that a door has set
};

/// Which tracker, or which live source: the address with what SessionRequest::crc says.
std::string server_address(const SessionRequest& request, const std::string& place);

}  // namespace palpate::running
