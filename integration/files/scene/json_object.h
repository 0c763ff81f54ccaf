#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "compute/volume/result.h"
#include "integration/files/scene/number_range.h"

namespace palpate::files {

/// The state of reading a JSON file: keeps the first error, with its place.
struct JsonReading {
  std::filesystem::path file;
  std::optional<Error> error;
  std::set<std::string>* accepted = nullptr;  ///< gets every key that was asked for, if wanted
  std::filesystem::path folder = file.parent_path();  ///< in which the file's own paths begin

  /// "'file' at place: what." with what saying what is wrong and, after a colon, what to do.
  void refuse(const std::string& place, const std::string& what);
};

/// One JSON object under its place in the file ("modes[1]"). Each call asks for one key: a missing
/// one leaves the value as it is, a wrong one refuses. finish() refuses keys that were not asked
/// for, and names the nearest known one.
class JsonObject {
 public:
  JsonObject(const nlohmann::json& value, std::string place, JsonReading& reading);

  /// The value of a key, or null. Remembers that the key exists.
  const nlohmann::json* find(std::string_view key);
  bool number(std::string_view key, double& out, const NumberRange& range = kAnyNumber);
  bool boolean(std::string_view key, bool& out);
  bool text(std::string_view key, std::string& out);
  /// Three numbers.
  bool vector(std::string_view key, glm::dvec3& out, const NumberRange& range = kAnyNumber);
  /// One string or a list of at least one, none empty.
  bool texts(std::string_view key, std::vector<std::string>& out);
  /// A list of at least one value of any kind.
  const nlohmann::json* list(std::string_view key);
  template <class T>
  bool choice(std::string_view key, T& out,
              const std::vector<std::pair<std::string_view, T>>& choices) {
    std::string word;
    if (!text(key, word)) return false;
    std::vector<std::string_view> words;
    for (const auto& [name, value] : choices) {
      if (name == word) return out = value, true;
      words.push_back(name);
    }
    refuse_word(key, word, words);
    return false;
  }
  void refuse_word(std::string_view key, const std::string& word,
                   const std::vector<std::string_view>& known);
  void refuse(std::string_view key, const std::string& what);
  void finish();
  std::string place(std::string_view key) const;
  bool good() const { return !reading_.error; }
  JsonReading& reading() { return reading_; }

 private:
  const nlohmann::json& value_;
  std::string place_;
  JsonReading& reading_;
  std::vector<std::string> known_;
};

/// Edits that turn one word into the other: letters put in, left out, changed, or two neighbours
/// exchanged (optimal string alignment).
size_t edits_between(std::string_view a, std::string_view b);

/// The word of `known` that is nearest to `word`, or nothing if none is near. Two neighbouring
/// letters in the wrong order count as one error.
std::string nearest_word(std::string_view word, const std::vector<std::string_view>& known);

/// The text of a JSON file; `//` comments are allowed. Refuses text that is not JSON (with line and
/// column) and keys that occur twice in one object.
std::optional<nlohmann::json> parse_json(std::string_view text, JsonReading& reading);

/// [x, y, z], and [w, x, y, z].
nlohmann::ordered_json list_of(glm::dvec3 v);
nlohmann::ordered_json list_of(const glm::dquat& q);

}  // namespace palpate::files
