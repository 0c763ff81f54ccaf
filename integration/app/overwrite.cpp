#include "integration/app/overwrite.h"

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "integration/files/atomic_file.h"
#include "integration/files/descriptor.h"
#include "integration/files/frames.h"
#include "integration/files/read_sequence.h"
#include "integration/files/sentences.h"
#include "integration/x3d/x3d_file.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

/// Largest size of a scene or header that is searched for names of files.
constexpr std::streamsize kMostText = 1 << 20;

std::string start_of(const fs::path& file) {
  std::string text(size_t(kMostText), '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(text.data(), kMostText);
  text.resize(size_t(stream.gcount()));
  return text;
}

std::string trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// All files that are read when a command reads the named files.
class InputFiles {
 public:
  void add(const fs::path& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      add_folder(path);
    } else if (fs::is_regular_file(path, error)) {
      add_file(path);
    }
  }

  /// The input that a path refers to; null if it is none.
  const fs::path* find(const fs::path& path) const {
    const auto id = files::file_id(path);
    const auto found = id ? paths_.find(*id) : paths_.end();
    return found == paths_.end() ? nullptr : &found->second;
  }

 private:
  bool remember(const fs::path& path) {
    const auto id = files::file_id(path);
    return id && paths_.emplace(*id, path).second;
  }

  void add_file(const fs::path& file) {
    if (!remember(file)) return;
    const std::string ending = file.extension().string();
    if (ending == ".json") add_strings(file, nlohmann::json::parse(start_of(file), nullptr, false));
    if (x3d::is_x3d(file)) add_scene_files(file);
    if (ending == ".mhd" || ending == ".nhdr") add_named_in_header(file);
  }

  void add_folder(const fs::path& folder) {
    if (!remember(folder)) return;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error))
      if (entry.is_regular_file(error)) add_file(entry.path());
    // Below this folder only DICOM is read, whose slices have none of the endings of palpate's
    // outputs.
    for (fs::recursive_directory_iterator
             entry(folder, fs::directory_options::skip_permission_denied, error),
         end;
         !error && entry != end; entry.increment(error))
      if (entry.depth() > 0 && !files::has_image_ending(entry->path()) &&
          entry->is_regular_file(error))
        remember(entry->path());
  }

  /// Adds the files that an X3D scene reads; none if it can not be read, which ends the command
  /// anyway.
  void add_scene_files(const fs::path& scene) {
    if (const auto read = x3d::read_x3d(scene))
      for (const fs::path& file : read->files) add(file);
  }

  /// Every string in a scene that is the name of a file counts as an input.
  void add_strings(const fs::path& scene, const nlohmann::json& value) {
    if (value.is_string() && !value.get_ref<const std::string&>().empty())
      add(scene.parent_path() / value.get_ref<const std::string&>());
    if (value.is_structured())
      for (const auto& part : value) add_strings(scene, part);
  }

  /// The same for the lines of a header, and for the text behind "key:" or "key =".
  void add_named_in_header(const fs::path& header) {
    const std::string text = start_of(header);
    for (size_t from = 0; from < text.size();) {
      const size_t to = std::min(text.find('\n', from), text.size());
      const std::string line = text.substr(from, to - from);
      const size_t key_end = line.find_first_of(":=");
      for (const std::string& name :
           {trimmed(line), key_end == std::string::npos ? "" : trimmed(line.substr(key_end + 1))})
        add_named_file(header.parent_path(), name);
      from = to + 1;
    }
  }

  /// A name, or a pattern such as "slice%03d.raw 1 20 1": then all files that match it except for
  /// the numbers.
  void add_named_file(const fs::path& folder, const std::string& name) {
    if (name.empty()) return;
    const size_t number = name.find('%');
    std::error_code error;
    if (number == std::string::npos) {
      if (fs::is_regular_file(folder / name, error)) add_file(folder / name);
      return;
    }
    const fs::path before = folder / name.substr(0, number);
    const size_t letter = name.find_first_of("di", number);
    const std::string after = letter == std::string::npos
                                  ? ""
                                  : name.substr(letter + 1, name.find(' ', letter) - letter - 1);
    for (const auto& entry : fs::directory_iterator(
             before.has_parent_path() ? before.parent_path() : fs::path("."), error)) {
      const std::string file = entry.path().filename().string();
      if (file.starts_with(before.filename().string()) && file.ends_with(after))
        remember(entry.path());
    }
  }

  std::map<files::FileId, fs::path> paths_;
};

}  // namespace

Status check_are_files(const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code error;
    const fs::file_status status = fs::status(input, error);
    if (!fs::exists(status) || fs::is_regular_file(status) || fs::is_directory(status)) continue;
    return files::bad_input(input,
                            "is a pipe or a device, not a file: save what comes out of it to a "
                            "file, and name that");
  }
  return Nothing{};
}

Status check_overwrites(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs) {
  InputFiles read;
  for (const fs::path& input : inputs) {
    const auto series = files::split_series(input);
    read.add(series ? series->folder : input);
  }
  std::set<fs::path> written;
  for (const fs::path& output : outputs) {
    if (output.empty()) continue;
    if (output == "-")
      return files::bad_output(output,
                               "would mean standard output, but palpate writes files: name a file "
                               "('./-' for one that is called so)");
    const fs::path* input = read.find(output);
    std::error_code error;
    if (input && fs::is_directory(output, error))
      return files::bad_output(output,
                               "is a folder that is read: what is written would lie among the "
                               "inputs; name another folder");
    if (input && *input == output)
      return files::bad_output(output, "is an input too and would be lost: name another output");
    if (input)
      return files::bad_output(
          output, "is the input '{}', which would be lost: name another output", input->string());
    const fs::path target = fs::weakly_canonical(files::behind_links(output), error);
    if (!written.insert(error ? output : target).second)
      return files::bad_output(output,
                               "is named for two outputs: name another file for one of them");
  }
  return Nothing{};
}

}  // namespace palpate::app
