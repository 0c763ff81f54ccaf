#include "integration/running/session_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "compute/motion/options.h"
#include "integration/files/scene/json_object.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/files/scene/scene_file.h"

namespace palpate::running {
namespace {

using nlohmann::json;
using Choices = loading::SequenceChoices;
constexpr OptionStage kScene = OptionStage::kScene, kSession = OptionStage::kSession;

template <auto Member>
auto& of_request(SessionRequest& request) {
  return request.*Member;
}
template <auto Member>
auto& of_sequence(SessionRequest& request) {
  return request.sequence.*Member;
}

constexpr std::pair<std::string_view, loading::FeltWall> kWalls[] = {
    {"values", loading::FeltWall::kValues},
    {"region", loading::FeltWall::kRegion},
    {"ridges", loading::FeltWall::kRidges}};

void set_wall(SessionRequest& request, std::string_view word) {
  for (const auto& [name, wall] : kWalls)
    if (name == word) request.sequence.wall = wall;
}

void set_values(SessionRequest& request, std::string_view word) {
  for (const auto& [name, values] : files::SceneWords::kValues)
    if (name == word) request.sequence.values = values;
}

template <class Pairs>
std::vector<std::string_view> first_of(const Pairs& pairs) {
  std::vector<std::string_view> words;
  for (const auto& pair : pairs) words.push_back(pair.first);
  return words;
}

std::vector<SessionOption> table() {
  return {
      // The scene.
      {.key = "iso_value",
       .stage = kScene,
       .member = of_sequence<&Choices::iso_value>,
       .range = files::kAnyNumber,
       .help = "Value of the surface to feel; else found in the data",
       .c_field = "PalSceneInfo.iso_value"},
      {.key = "width",
       .stage = kScene,
       .member = of_sequence<&Choices::width>,
       .range = files::kWidths,
       .help = "Over so many values around it the strength rises; else found in the data",
       .c_field = "PalSceneInfo.width"},
      {.key = "strength_n",
       .stage = kScene,
       .member = of_sequence<&Choices::strength_n>,
       .range = files::kSurfaceStrengths_n,
       .fallback = "4",
       .help = "Greatest force of the surface, N",
       .c_field = "PalSceneInfo.strength_n"},
      {.key = "friction",
       .stage = kScene,
       .member = of_sequence<&Choices::friction>,
       .range = files::kFrictions,
       .fallback = "0.2",
       .help = "Coulomb's mu; 0: no friction",
       .c_field = "PalSceneInfo.friction"},
      {.key = "frames_per_second",
       .stage = kScene,
       .member = of_sequence<&Choices::frames_per_second>,
       .range = files::kFrameRates,
       .help = "Frames per second, instead of the file's times. Without either, all frames are "
               "played in one second, at most 30 a second",
       .c_field = "PalSceneInfo.frames_per_second"},
      {.key = "fields",
       .stage = kScene,
       .member = of_sequence<&Choices::fields>,
       .path = PathUse::kFileOrFolder,
       .help = "What 'palpate motion' wrote, its folder or its sequence_motion.nrrd; else the "
               "motion is estimated while the data are felt or served",
       .c_field = "PalSceneInfo.fields"},
      {.key = "values",
       .stage = kScene,
       .member = SetWord(set_values),
       .words = first_of(files::SceneWords::kValues),
       .help = "Whose values: reference (one frame's, carried by one motion: the same wall at "
               "every phase), mean (of all frames where their material is in that one, carried "
               "likewise: less noise), own (each frame's own: for flows and simulations). Without "
               "it: reference where one motion is known or found, else own",
       .c_field = "PalSceneInfo.values"},
      {.key = "nan_as",
       .stage = kScene,
       .member = of_sequence<&Choices::nan_as>,
       .range = files::kAnyNumber,
       .help = "What samples become that are NaN, as SPM and fMRIPrep write outside the body"},
      {.key = "modes",
       .stage = kScene,
       .member = of_sequence<&Choices::mode_libraries>,
       .path = PathUse::kFile,
       .help = "Libraries (.so) with haptic modes of your own, which a scene file may name: code "
               "that is run (docs/writing-a-mode.md)",
       .c_field = "PalSceneInfo.mode_libraries"},
      {.key = "folder",
       .stage = kScene,
       .member = of_sequence<&Choices::folder>,
       .path = PathUse::kFolder,
       .help = "Folder in which the files that a scene file names are; else beside it",
       .c_field = "PalSceneInfo.folder"},
      {.key = "segments",
       .stage = kScene,
       .member = of_sequence<&Choices::segments>,
       .path = PathUse::kFile,
       .help = "Segmentation: a .seg.nrrd of 3D Slicer or a label map, one or one per frame. Its "
               "parts are the walls; the values only with `iso_value`",
       .c_field = "PalSceneInfo.segments"},
      {.key = "segments_frame",
       .stage = kScene,
       .member = of_sequence<&Choices::segments_frame>,
       .range = files::kFrameNumbers,
       .fallback = "0",
       .help = "The frame, from 0 on, that a single segmentation is of",
       .c_field = "PalSceneInfo.segments_frame"},
      {.key = "segment_names",
       .stage = kScene,
       .member = of_sequence<&Choices::segment_names>,
       .help = "Only these parts of the segmentation, by name or label",
       .c_field = "PalSceneInfo.segment_names"},
      {.key = "wall",
       .stage = kScene,
       .member = SetWord(set_wall),
       .words = first_of(kWalls),
       .help = "What surface is felt of scalars: values (the iso-surface), region (a smooth one "
               "around what is brighter), ridges (where the values rise most steeply). Without "
               "it: values if they make a closed wall, else region",
       .c_field = "PalSceneInfo.wall"},
      {.key = "scale",
       .stage = kScene,
       .member = of_request<&SessionRequest::scale>,
       .range = files::kScales,
       .words = {"fit"},
       .fallback = "fit",
       .help = "Size of the volume: fit (into the device's reach), or a number",
       .c_field = "PalSceneInfo.scale"},
      {.key = "true_size",
       .stage = kScene,
       .member = of_request<&SessionRequest::true_size>,
       .help = "A sequence without a scene file keeps its size",
       .c_field = "PAL_SCENE_TRUE_SIZE",
       .doors = kHostDoors},
      {.key = "movable",
       .stage = kScene,
       .member = of_request<&SessionRequest::movable>,
       .help = "The host may place volumes that nothing else moves",
       .c_field = "PAL_SCENE_MOVABLE",
       .doors = kHostDoors},
      {.key = "forget_motion",
       .stage = kScene,
       .member = of_request<&SessionRequest::forget_motion>,
       .help = "heart, shell: forget the known motion and estimate it, as a patient's would be",
       .c_field = "PAL_SCENE_FORGET_MOTION"},
      {.key = "motion",
       .stage = kScene,
       .member = of_request<&SessionRequest::motion>,
       .fallback = "true",
       .help = "Without it the frames are felt as they are, without motion between them",
       .c_field = "PAL_SCENE_NO_MOTION"},
      {.key = "cyclic",
       .stage = kScene,
       .member = of_sequence<&Choices::cyclic>,
       .fallback = "true",
       .help = "The last frame leads back to the first",
       .c_field = "PAL_SCENE_NOT_CYCLIC"},
      {.key = "image",
       .stage = kScene,
       .member = of_request<&SessionRequest::image>,
       .help = "igtl://...: the images of this device name (default: of the first that comes)",
       .c_field = "PalSceneInfo.image"},
      {.key = "transform",
       .stage = kScene,
       .member = of_request<&SessionRequest::transform>,
       .help = "igtl://...: the transforms of this device name move the volume",
       .c_field = "PalSceneInfo.transform"},
      {.key = "wait_s",
       .stage = kScene,
       .member = of_request<&SessionRequest::wait_s>,
       .range = files::kWaits_s,
       .help = "igtl://...: how long to wait for the first image, s (a host: 10; the program: "
               "until it is stopped)",
       .c_field = "PalSceneInfo.wait_s"},
      {.key = "crc",
       .stage = kScene,
       .member = of_request<&SessionRequest::crc>,
       .fallback = "true",
       .help = "igtl://...: without it, messages are accepted whose sender computes no CRC (PLUS "
               "does so if it is not asked to); the same as ?crc=none behind the address"},

      // The device.
      {.key = "device",
       .stage = kSession,
       .member = of_request<&SessionRequest::device>,
       .fallback = "auto",
       .help = "Force device; KIND@ADDRESS is the one that 'palpate devices' shows there; "
               "igtl://HOST:PORT is a tracked tool",
       .c_field = "PalSessionInfo.device_name",
       .doors = kSafeDoors},
      {.key = "second_device",
       .stage = kSession,
       .member = of_request<&SessionRequest::second_device>,
       .help = "Force device of a second hand in the same scene, as `device`: KIND@ADDRESS, or "
               "simulated",
       .doors = kProgramDoor},
      {.key = "falcon_firmware",
       .stage = kSession,
       .member = of_request<&SessionRequest::falcon_firmware>,
       .path = PathUse::kFile,
       .help = "Your own copy of the Falcon's firmware; palpate ships none"},
      {.key = "path",
       .stage = kSession,
       .member = of_request<&SessionRequest::path>,
       .fallback = "press",
       .help = "Simulated hand: press, tap, stroke, circle, sweep, or a file of t_s,x_m,y_m,z_m",
       .c_field = "PalSessionInfo.simulated_path",
       .doors = kSafeDoors},
      {.key = "hand",
       .stage = kSession,
       .member = of_request<&SessionRequest::hand>,
       .words = {"human", "loose", "firm", "none"},
       .fallback = "human",
       .help = "Simulated hand: how it holds the device",
       .c_field = "PalSessionInfo.simulated_hand",
       .doors = kSafeDoors},
      {.key = "lets_go_s",
       .stage = kSession,
       .member = of_request<&SessionRequest::lets_go_s>,
       .range = files::kLettingGo_s,
       .help = "Simulated hand: lets go after so many s; else never",
       .c_field = "PalSessionInfo.lets_go_s",
       .doors = kSafeDoors},
      {.key = "tool",
       .stage = kSession,
       .member = of_request<&SessionRequest::tool>,
       .help = "The transforms of this device name are the tracked tool (default: of the first "
               "that come)",
       .c_field = "PalSessionInfo.tool",
       .doors = kSafeDoors},
      {.key = "stiffness_n_per_m",
       .stage = kSession,
       .member = of_request<&SessionRequest::stiffness_n_per_m>,
       .range = files::kStiffnesses_n_per_m,
       .help = "Of the spring, N/m, instead of the scene's",
       .c_field = "PalSessionInfo.stiffness_n_per_m"},
      {.key = "max_force_n",
       .stage = kSession,
       .member = of_request<&SessionRequest::max_force_n>,
       .range = files::kForces_n,
       .help = "N, instead of the scene's",
       .c_field = "PalSessionInfo.max_force_n"},
      {.key = "tool_radius_mm",
       .stage = kSession,
       .member = of_request<&SessionRequest::tool_radius_mm>,
       .range = files::kToolRadii_mm,
       .help = "Of the ball at the tip of the tool, mm in the world, instead of the scene's; 0: a "
               "point",
       .doors = kSafeDoors},
      {.key = "tool_points",
       .stage = kSession,
       .member = of_request<&SessionRequest::tool_points>,
       .range = files::kToolPoints,
       .help = "Of a finger pad, instead of the scene's: points across the grip's shaft on a "
               "circle of the tool's radius (5 mm if it has none), a fifth in its middle; they "
               "share the force and give a torque. 1: a point or a ball",
       .doors = kSafeDoors},
      {.key = "dead_man",
       .stage = kSession,
       .member = of_request<&SessionRequest::dead_man>,
       .help = "Force only while a button of the device, or a controller's dead-man, is held",
       .c_field = "PAL_SESSION_DEAD_MAN",
       .doors = kSafeDoors},
      {.key = "watchdog_s",
       .stage = kSession,
       .member = of_request<&SessionRequest::watchdog_s>,
       .range = files::kWatchdogs_s,
       .help = "A tick later than this is a fault: the force is ramped down (5 ms; a simulated "
               "hand, a mouse or a tracked tool: 50 ms)",
       .c_field = "PalSessionInfo.watchdog_s",
       .doors = kSafeDoors},
      // From 3 m/s on a tracked tool counts as lost, too.
      {.key = "max_hand_speed_m_per_s",
       .stage = kSession,
       .member = of_request<&SessionRequest::max_hand_speed_m_per_s>,
       .range = {0.1, 3.0, false, "m/s"},
       .fallback = "1.5",
       .help = "A hand that moves faster than this is damped, and the force ends if it moves at "
               "twice that",
       .doors = kSafeDoors},
      {.key = "real_time",
       .stage = kSession,
       .member = of_request<&SessionRequest::real_time>,
       .fallback = "true",
       .help = "Without it, the system is asked for no priority and no locked memory",
       .c_field = "PAL_SESSION_NO_REAL_TIME",
       .doors = kSafeDoors},
      {.key = "core",
       .stage = kSession,
       .member = of_request<&SessionRequest::core>,
       .range = files::kCores,
       .help = "Pin the servo thread to this core"},
      {.key = "tube_buttons",
       .stage = kSession,
       .member = of_request<&SessionRequest::tube_buttons>,
       .range = files::kButtonBits,
       .fallback = "0",
       .help = "Bit k: button k of the device lays stream tubes",
       .c_field = "PalSessionInfo.tube_buttons",
       .doors = kHostDoors},

      // Estimation.
      {.key = "preset",
       .stage = kSession,
       .member = of_request<&SessionRequest::preset>,
       .words = {kMotionPresets.begin(), kMotionPresets.end()},
       .help = "Effort of the estimation, as in 'palpate motion' (balanced; of a live source: "
               "fast)",
       .c_field = "PalSessionInfo.preset",
       .doors = kSafeDoors},
      {.key = "estimate",
       .stage = kSession,
       .member = of_request<&SessionRequest::estimate>,
       .fallback = "true",
       .help = "Motion that is not given is estimated while the data are felt",
       .c_field = "PAL_SESSION_NO_ESTIMATION",
       .doors = kHostDoors},
      {.key = "follow",
       .stage = kSession,
       .member = of_request<&SessionRequest::follow>,
       .help = "igtl://...: follow every frame, even where they repeat",
       .c_field = "PAL_SESSION_FOLLOW",
       .doors = kSafeDoors},

      // What is kept and served: no scene file of a stranger may write files or open a port.
      {.key = "serve",
       .stage = kSession,
       .member = of_request<&SessionRequest::serve>,
       .range = files::kPorts,
       .help = "Send what is felt, the moved volume and its motion to OpenIGTLink clients (3D "
               "Slicer) that connect to this port",
       .c_field = "PalSessionInfo.serve_port"},
      {.key = "web",
       .stage = kSession,
       .member = of_request<&SessionRequest::web>,
       .range = files::kPorts,
       .help = "Show the scene in browsers and their headsets: a page on https at this port (18946 "
               "without a number); its address and its certificate's fingerprint are printed",
       .doors = kProgramDoor},
      {.key = "web_address",
       .stage = kSession,
       .member = of_request<&SessionRequest::web_address>,
       .fallback = "127.0.0.1",
       .help = "With `web`: the address of this machine at which the page is reached; 127.0.0.1 is "
               "this machine alone, 0.0.0.0 every network",
       .doors = kProgramDoor},
      {.key = "csv",
       .stage = kSession,
       .member = of_request<&SessionRequest::csv>,
       .path = PathUse::kOutputFile,
       .help = "Write every tick",
       .c_field = "PalSessionInfo.csv"},
      {.key = "record",
       .stage = kSession,
       .member = of_request<&SessionRequest::record>,
       .path = PathUse::kOutputFile,
       .help = "Record all that the loop depends on",
       .c_field = "PalSessionInfo.recording"},
      {.key = "black_box",
       .stage = kSession,
       .member = of_request<&SessionRequest::black_box>,
       .path = PathUse::kOutputFolder,
       .help = "Folder for the ticks around a fault, or off (default: $XDG_STATE_HOME/palpate, or "
               "~/.local/state/palpate)",
       .c_field = "PalSessionInfo.black_box"},
  };
}

std::string word_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

Error expected(const SessionOption& option, const json& value, const std::string& what) {
  return {ErrorKind::kBadInput,
          fmt::format("{} is {}, but {} is expected", option.key, word_of(value), what)};
}

/// A number, also as the text "nan" or "inf", which JSON can not say.
std::optional<double> number_of(const json& value) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) return std::nullopt;
  const auto& word = value.get_ref<const std::string&>();
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (word == "inf") return std::numeric_limits<double>::infinity();
  if (word == "-inf") return -std::numeric_limits<double>::infinity();
  return std::nullopt;
}

/// How each kind of member takes a value.
class Setter {
 public:
  Setter(SessionRequest& request, const SessionOption& option, const json& value)
      : request_(request), option_(option), value_(value) {}

  Status operator()(MemberOf<bool> member) const {
    if (!value_.is_boolean()) return expected(option_, value_, "true or false");
    member(request_) = value_.get<bool>();
    return Nothing{};
  }
  Status operator()(MemberOf<double> member) const {
    return number([&](double number) { member(request_) = number; });
  }
  Status operator()(MemberOf<std::optional<double>> member) const {
    if (value_.is_string() && is_word(value_.get<std::string>())) {
      member(request_).reset();
      return Nothing{};
    }
    return number([&](double number) { member(request_) = number; });
  }
  Status operator()(MemberOf<std::optional<float>> member) const {
    return number([&](double number) { member(request_) = float(number); });
  }
  Status operator()(MemberOf<int> member) const { return whole(member); }
  Status operator()(MemberOf<uint32_t> member) const { return whole(member); }
  Status operator()(MemberOf<size_t> member) const { return whole(member); }
  Status operator()(MemberOf<std::string> member) const {
    if (!option_.words.empty())
      return word([&](const std::string& word) { member(request_) = word; });
    if (!value_.is_string()) return expected(option_, value_, "a text");
    member(request_) = value_.get<std::string>();
    return Nothing{};
  }
  Status operator()(MemberOf<std::filesystem::path> member) const {
    if (!value_.is_string() || value_.get<std::string>().empty())
      return expected(option_, value_, "a path");
    member(request_) = value_.get<std::string>();
    return Nothing{};
  }
  template <class T>
  Status operator()(MemberOf<std::vector<T>> member) const {
    const json list = value_.is_array() ? value_ : json::array({value_});
    for (const json& one : list)
      if (!one.is_string() || one.get<std::string>().empty())
        return expected(option_, one, "a text, or a list of texts,");
    member(request_).clear();
    for (const json& one : list) member(request_).emplace_back(one.get<std::string>());
    return Nothing{};
  }
  Status operator()(SetWord set) const {
    return word([&](const std::string& word) { set(request_, word); });
  }

 private:
  bool is_word(const std::string& word) const {
    return std::find(option_.words.begin(), option_.words.end(), word) != option_.words.end();
  }
  template <class Take>
  Status number(const Take& take) const {
    const std::optional<double> number = number_of(value_);
    if (!number) return expected(option_, value_, files::text_of(option_.range));
    if (!files::is_in(*number, option_.range))
      return Error{ErrorKind::kBadInput, files::out_of_range(option_.key, *number, option_.range)};
    take(*number);
    return Nothing{};
  }
  template <class Whole>
  Status whole(MemberOf<Whole> member) const {
    if (value_.is_number() && std::trunc(value_.get<double>()) != value_.get<double>())
      return expected(option_, value_, "a whole number");
    return number([&](double number) { member(request_) = Whole(number); });
  }
  template <class Take>
  Status word(const Take& take) const {
    if (value_.is_string() && is_word(value_.get<std::string>())) {
      take(value_.get<std::string>());
      return Nothing{};
    }
    const std::string near = value_.is_string()
                                 ? files::nearest_word(value_.get<std::string>(), option_.words)
                                 : std::string();
    return Error{
        ErrorKind::kBadInput,
        fmt::format("{} '{}' is not known: {}choose one of {}", option_.key, word_of(value_),
                    near.empty() ? "" : fmt::format("did you mean '{}'? Otherwise ", near),
                    fmt::join(option_.words, ", "))};
  }

  SessionRequest& request_;
  const SessionOption& option_;
  const json& value_;
};

}  // namespace

std::span<const SessionOption> session_options() {
  static const std::vector<SessionOption> options = table();
  return options;
}

const SessionOption* find_option(std::string_view key) {
  for (const SessionOption& option : session_options())
    if (option.key == key) return &option;
  return nullptr;
}

std::string_view type_of(const SessionOption& option) {
  struct Types {
    const SessionOption& option;
    std::string_view operator()(MemberOf<bool>) const { return "flag"; }
    std::string_view operator()(MemberOf<double>) const { return "number"; }
    std::string_view operator()(MemberOf<std::optional<double>>) const { return "number"; }
    std::string_view operator()(MemberOf<std::optional<float>>) const { return "number"; }
    std::string_view operator()(MemberOf<int>) const { return "whole number"; }
    std::string_view operator()(MemberOf<uint32_t>) const { return "whole number"; }
    std::string_view operator()(MemberOf<size_t>) const { return "whole number"; }
    std::string_view operator()(MemberOf<std::string>) const {
      if (!option.words.empty()) return "word";
      return option.path == PathUse::kNone ? "text" : "path";
    }
    std::string_view operator()(MemberOf<std::filesystem::path>) const { return "path"; }
    std::string_view operator()(MemberOf<std::vector<std::filesystem::path>>) const {
      return "paths";
    }
    std::string_view operator()(MemberOf<std::vector<std::string>>) const { return "texts"; }
    std::string_view operator()(SetWord) const { return "word"; }
  };
  return std::visit(Types{option}, option.member);
}

Status set_option(SessionRequest& request, const SessionOption& option, const json& value) {
  const Status set = std::visit(Setter(request, option, value), option.member);
  if (set) request.given.insert(option.key);
  return set;
}

Status set_option(SessionRequest& request, std::string_view key, const json& value) {
  if (const SessionOption* option = find_option(key)) return set_option(request, *option, value);
  std::vector<std::string_view> known;
  for (const SessionOption& option : session_options()) known.push_back(option.key);
  const std::string near = files::nearest_word(std::string(key), known);
  return Error{ErrorKind::kBadInput,
               fmt::format("There is no option '{}'{}", key,
                           near.empty() ? "" : fmt::format(": did you mean '{}'?", near))};
}

Status set_options(SessionRequest& request, std::string_view text, Door door, OptionStage stage,
                   bool keep_given) {
  const json all = json::parse(text, nullptr, false, true);
  if (!all.is_object())
    return Error{ErrorKind::kBadInput,
                 "The text of options is no JSON object, as {\"watchdog_s\": 0.01} is"};
  SessionRequest changed = request;
  for (const auto& [key, value] : all.items()) {
    const SessionOption* const option = find_option(key);
    if (option && !(option->doors & door))
      return Error{ErrorKind::kBadInput,
                   fmt::format("{} can not be set here: {}", key,
                               door == kSceneFileDoor
                                   ? "what writes files, opens a port or is the user's own is no "
                                     "part of a scene"
                                   : "another part of the program decides it")};
    if (option && option->stage != stage)
      return Error{ErrorKind::kBadInput,
                   fmt::format("{} is an option of the {}: give it where that is opened", key,
                               option->stage == kScene ? "scene" : "session")};
    if (keep_given && option && request.given.contains(option->key)) continue;
    if (const Status set = set_option(changed, key, value); !set) return set;
  }
  request = std::move(changed);
  return Nothing{};
}

std::string options_json() {
  json rows = json::array();
  for (const SessionOption& option : session_options()) {
    json row = {
        {"key", option.key},          {"stage", option.stage == kScene ? "scene" : "session"},
        {"type", type_of(option)},    {"unit", option.range.unit},
        {"default", option.fallback}, {"help", option.help},
        {"c_field", option.c_field},  {"doors", json::array()}};
    if (std::isfinite(option.range.low)) row["low"] = option.range.low;
    if (std::isfinite(option.range.high)) row["high"] = option.range.high;
    if (option.range.above_low) row["above_low"] = true;
    if (!option.words.empty()) row["words"] = option.words;
    for (const auto& [door, name] : {std::pair(kProgramDoor, "program"),
                                     {kSceneFileDoor, "scene"},
                                     {kCDoor, "c"},
                                     {kPythonDoor, "python"}})
      if (option.doors & door) row["doors"].push_back(name);
    rows.push_back(std::move(row));
  }
  return rows.dump(1);
}

}  // namespace palpate::running
