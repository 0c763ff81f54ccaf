#include "integration/app/chart/wish.h"

#include "integration/app/chart/front_file.h"
#include "integration/studies/quantity.h"

namespace palpate::app {

Result<std::vector<studies::Choice>> choose_settings(const std::string& within,
                                                     const std::string& error, const Grid& grid,
                                                     const std::string& device) {
  const auto limit =
      within.empty() ? studies::parse_millimetres(error) : studies::parse_seconds(within);
  if (!limit) return limit.error();
  const auto front = read_front(device);
  if (!front) return front.error();
  if (within.empty()) return choose_by_error(*front, *limit, grid.count(), grid.finest_mm());
  auto choice = choose_within(*front, *limit, grid.count(), grid.finest_mm());
  if (!choice) return choice.error();
  return std::vector{std::move(*choice)};
}

}  // namespace palpate::app
