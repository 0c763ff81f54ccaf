#include "tests/lab/report/labels.h"

#include <algorithm>

#include "tests/lab/report/axes.h"
#include "tests/lab/report/style.h"

namespace palpate::report {
namespace {

// Half the width of a mark, with some distance.
constexpr double kMarkPx = 6.0;

struct Box {
  double left, right, bottom, top;
};

bool overlap(const Box& a, const Box& b) {
  return a.left < b.right && b.left < a.right && a.bottom < b.top && b.bottom < a.top;
}

bool inside(const Box& a, const Box& b) {
  return a.left >= b.left && a.right <= b.right && a.bottom >= b.bottom && a.top <= b.top;
}

}  // namespace

std::vector<Placed> placed_labels(const std::vector<Tag>& tags, double left, double right,
                                  double bottom, double top) {
  const Box all{left, right, bottom, top};
  std::vector<Box> taken;
  for (const Tag& tag : tags)
    taken.push_back({tag.x - kMarkPx, tag.x + kMarkPx, tag.y - kMarkPx, tag.y + kMarkPx});
  std::vector<Placed> placed;
  for (size_t n = 0; n < tags.size(); ++n) {
    if (tags[n].text.empty()) continue;
    const double wide = text_width_px(tags[n].text), high = kFontPx, away = kMarkPx + 1.0;
    const double x = tags[n].x, y = tags[n].y;
    // A little above the mark first: stairs and lines leave it to the right or downwards.
    const std::pair<double, double> corners[] = {
        {x + away, y + away / 2},        {x + away, y - high / 2},
        {x - wide / 2, y + away},        {x - away - wide, y - high / 2},
        {x - away - wide, y + away / 2}, {x - wide / 2, y - away - high},
        {x + away, y - away / 2 - high}, {x - away - wide, y - away / 2 - high}};
    for (const auto& [x0, y0] : corners) {
      const Box box{x0, x0 + wide, y0, y0 + high};
      if (!inside(box, all) || std::any_of(taken.begin(), taken.end(),
                                           [&](const Box& other) { return overlap(box, other); }))
        continue;
      taken.push_back(box);
      placed.push_back({n, x0, y0});
      break;
    }
  }
  return placed;
}

}  // namespace palpate::report
