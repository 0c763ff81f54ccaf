#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "integration/files/scene/number_range.h"
#include "integration/running/session_request.h"

namespace palpate::running {

/// When an option has its effect: a scene is read once, and may be felt in more than one session.
enum class OptionStage : uint8_t { kScene, kSession };

/// Who may set an option; bits.
enum Door : uint8_t {
  kProgramDoor = 1,    ///< palpate feel
  kSceneFileDoor = 2,  ///< the section `session` of a scene file
  kCDoor = 4,          ///< palpate.h: a field of a structure, or its text of options
  kPythonDoor = 8,
  kHostDoors = kCDoor | kPythonDoor,
  kSafeDoors = kProgramDoor | kSceneFileDoor | kHostDoors,  ///< writes nothing, opens no port
  kAllButFiles = kProgramDoor | kHostDoors,
};

/// What a path is, for checks before a long run.
enum class PathUse : uint8_t { kNone, kFile, kFolder, kFileOrFolder, kOutputFile, kOutputFolder };

/// The member of a request that an option sets. A word is set by its name.
template <class T>
using MemberOf = T& (*)(SessionRequest&);
using SetWord = void (*)(SessionRequest&, std::string_view);
using OptionMember =
    std::variant<MemberOf<bool>, MemberOf<double>, MemberOf<std::optional<double>>,
                 MemberOf<std::optional<float>>, MemberOf<int>, MemberOf<uint32_t>,
                 MemberOf<size_t>, MemberOf<std::string>, MemberOf<std::filesystem::path>,
                 MemberOf<std::vector<std::filesystem::path>>, MemberOf<std::vector<std::string>>,
                 SetWord>;

/// A row of the table. A new option is a row here, a member of SessionRequest, and the place that
/// reads it; the doors show it by themselves.
struct SessionOption {
  /// Its name in scene files, in texts of options and in Python, with its unit; the program's
  /// option has the same name without the unit.
  std::string_view key;
  OptionStage stage;
  OptionMember member;
  files::NumberRange range{};             ///< of numbers
  std::vector<std::string_view> words{};  ///< the values, or words besides a number
  PathUse path = PathUse::kNone;
  std::string_view fallback{};  ///< value without the option; empty: `help` says what happens
  std::string_view help;        ///< one sentence; names other options as `key`
  std::string_view c_field{};   ///< where palpate.h has it; empty: in the text of options
  uint8_t doors = kAllButFiles;
};

std::span<const SessionOption> session_options();
/// Null if there is none.
const SessionOption* find_option(std::string_view key);

/// "flag", "number", "whole number", "word", "text", "path", "paths", "texts": for people.
std::string_view type_of(const SessionOption& option);

/// Sets an option from a JSON value: true or false, a number, a text, or a list of texts. Errors:
/// kBadInput, with the key, the value and what is expected ("watchdog_s is 5, but a number from
/// 0.001 to 1 s is expected"); the request is unchanged. Any thread.
Status set_option(SessionRequest& request, const SessionOption& option,
                  const nlohmann::json& value);
Status set_option(SessionRequest& request, std::string_view key, const nlohmann::json& value);

/// Sets the options of a JSON object, {"watchdog_s": 0.01, "preset": "fast"}. `door` and `stage`:
/// those that may stand there. keep_given: options that were set before keep their value (a scene
/// file's section). Errors: as set_option(), for a text that is no JSON object, and for keys that
/// are unknown (the nearest is named) or have no place there.
Status set_options(SessionRequest& request, std::string_view json, Door door, OptionStage stage,
                   bool keep_given = false);

/// The table as JSON, for hosts that show options to people: a list of objects with key, stage,
/// type, unit, low, high, above_low, words, default, help, c_field and doors.
std::string options_json();

}  // namespace palpate::running
