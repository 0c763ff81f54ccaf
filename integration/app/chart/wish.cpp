#include "integration/app/chart/wish.h"

#include "integration/app/chart/front_file.h"
#include "integration/studies/quantity.h"

namespace palpate::app {

Result<studies::Choice> choose_setting(const std::string& within, const std::string& error,
                                       const Grid& grid, const std::string& device) {
  const auto limit =
      within.empty() ? studies::parse_millimetres(error) : studies::parse_seconds(within);
  if (!limit) return limit.error();
  const auto front = read_front(device);
  if (!front) return front.error();
  return within.empty() ? choose_error(*front, *limit, grid.count(), grid.finest_mm())
                        : choose_within(*front, *limit, grid.count(), grid.finest_mm());
}

}  // namespace palpate::app
