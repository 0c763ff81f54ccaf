#include "integration/app/chart/stability.h"
#include "integration/app/commands.h"

namespace palpate::app {

Command add_chart(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("chart", "Reports of what palpate can do, and where it fails");
  app->require_subcommand(1);
  const Command stability = add_chart_stability(*app);
  return {app, [stability] { return stability.run(); }};
}

}  // namespace palpate::app
