#pragma once

#include <string>

namespace palpate::app {

/// The commit that was built, as `git describe --always --dirty` names it; "unknown" if the source
/// was no git checkout.
const char* built_commit();

/// "palpate 0.1.0"; with `verbose` also what a report of an error needs, a line each: the commit,
/// the type of the build and its compiler, and the Vulkan device that is used without --gpu with
/// its driver, or why there is none. Opens that device, which takes some tenths of a second.
std::string version_text(const std::string& program, bool verbose);

}  // namespace palpate::app
