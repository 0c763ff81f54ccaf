#include "integration/app/version.h"

#include <fmt/format.h>

#include "commit.h"
#include "integration/app/gpu.h"

namespace palpate::app {

const char* built_commit() {
  return kCommit;
}

std::string version_text(const std::string& program, bool verbose) {
  std::string text = fmt::format("{} {}", program, PALPATE_VERSION);
  if (!verbose) return text;
  text += fmt::format("\nCommit    {}\nBuild     {}", kCommit, PALPATE_BUILD);
  const OpenedContext context = vulkan::Context::open({});
  if (!context) return text + fmt::format("\nDevice    none: {}", context.error().message);
  const vulkan::GpuInfo& info = (*context)->info();
  return text + fmt::format("\nDevice    {} ({})\nDriver    {}, Vulkan {}.{}", info.name, info.kind,
                            info.driver, info.api_major, info.api_minor);
}

}  // namespace palpate::app
