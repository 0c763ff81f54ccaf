#include "integration/app/headset/problem_text.h"

#include "integration/app/progress.h"

namespace palpate::app {

std::string problem_text(const xr::Problem& problem) {
  const std::string call = xr::call_text(problem);
  return problem.message + (Console::verbose() && !call.empty() ? " (" + call + ".)" : "");
}

}  // namespace palpate::app
