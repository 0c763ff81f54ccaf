#include "integration/loading/mode_library.h"

#include <algorithm>
#include <exception>
#include <iterator>

#include "integration/files/sentences.h"
#include "integration/files/shared_library.h"
#include "integration/loading/c_modes.h"

namespace palpate::loading {
namespace {

namespace fs = std::filesystem;

using StampFunction = void(ModeLibraryStamp*);
using AddFunction = void(ModeKinds*);
using KindsInC = decltype(pal_mode_kinds);

/// Adds the kinds of a library that was written against palpate_mode.h.
Status add_all(const fs::path& file, KindsInC* kinds_of, ModeKinds& kinds) {
  const PalModeKind* found = nullptr;
  const uint32_t count = kinds_of(PAL_MODE_VERSION, &found);
  if (count == 0 || !found)
    return files::bad_input(file,
                            "has no haptic modes for this palpate: compile it again with this "
                            "one's palpate_mode.h");
  for (uint32_t k = 0; k < count; ++k)
    if (const Status added = add_c_mode(found[k], kinds); !added)
      return files::bad_input(file, "has a mode that can not be used: {}", added.error().message);
  return Nothing{};
}

Status load(const fs::path& file, ModeKinds& kinds) {
  // With its folder, so that no other library of this name is found. Never closed: its modes live
  // as long as scenes do.
  const files::SharedLibrary library(fs::absolute(file));
  if (!library.is_open()) return files::bad_input(file, "can not be loaded: {}", library.problem());
  try {
    if (auto* const in_c = library.find<KindsInC>("pal_mode_kinds"))
      return add_all(file, in_c, kinds);
    auto* const stamp = library.find<StampFunction>("palpate_modes_stamp");
    auto* const add = library.find<AddFunction>("palpate_add_modes");
    if (!stamp || !add)
      return files::bad_input(file,
                              "is no library of haptic modes: it lacks PALPATE_MODES or "
                              "pal_mode_kinds (docs/writing-a-mode.md)");
    ModeLibraryStamp theirs;
    stamp(&theirs);
    if (theirs != ModeLibraryStamp{})
      return files::bad_input(
          file,
          "was compiled for another version of palpate: compile it again with this one's headers");
    add(&kinds);
  } catch (const std::exception& error) {
    return files::bad_input(file, "failed while it added its haptic modes: {}", error.what());
  } catch (...) {
    return files::bad_input(file, "failed while it added its haptic modes");
  }
  return Nothing{};
}

}  // namespace

Result<ModeKinds> load_modes(const std::vector<fs::path>& libraries) {
  ModeKinds kinds;
  for (const fs::path& file : libraries)
    if (const Status loaded = load(file, kinds); !loaded) return loaded.error();
  return kinds;
}

std::vector<std::string> added_kinds(const ModeKinds& kinds) {
  const std::vector<std::string> all = kinds.names(), ours = ModeKinds{}.names();
  std::vector<std::string> added;
  std::set_difference(all.begin(), all.end(), ours.begin(), ours.end(), std::back_inserter(added));
  return added;
}

}  // namespace palpate::loading
