// Pages in a real browser: Debian's chromium, headless. Skipped if it is not installed.
#include <cairo.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/lab/report/child.h"
#include "tests/lab/report/page.h"
#include "tests/lab/report/plot.h"

namespace palpate::report {
namespace {

namespace fs = std::filesystem;

/// Sends measures of the shown page to the window around it: whether it is dark, by how many pixels
/// it is wider than its window, the smallest contrast of a text with its background (WCAG 2: 4.5 is
/// readable for most). Then the smallest letters of a plot in pixels, and the smallest contrast of
/// a plot's curves and marks (3 is required).
constexpr const char* kMeasure = R"js(<script>//<![CDATA[
addEventListener('load', () => {
  const rgb = (text) => (text.match(/[\d.]+/g) || [0, 0, 0]).map(Number);
  const light = (c) => { const f = (v) => (v /= 255) > 0.04045 ? ((v + 0.055) / 1.055) ** 2.4 : v / 12.92;
    return 0.2126 * f(c[0]) + 0.7152 * f(c[1]) + 0.0722 * f(c[2]); };
  const contrast = (a, b) => { const [x, y] = [light(a), light(b)];
    return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05); };
  const below = (e) => {
    for (; e; e = e.parentElement) {
      if (e.tagName === 'svg') return rgb(getComputedStyle(e.querySelector('path')).fill);
      const c = rgb(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > 0.9) return c;
    }
    return [255, 255, 255];
  };
  let text = 99, mark = 99, letters = 99;
  for (const e of document.body.querySelectorAll('*')) {
    if (![...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim())) continue;
    if (['SCRIPT', 'STYLE', 'title', 'desc'].includes(e.tagName) || !e.getClientRects().length) continue;
    const style = getComputedStyle(e);
    text = Math.min(text, contrast(rgb(e.closest('svg') ? style.fill : style.color), below(e)));
  }
  for (const svg of document.querySelectorAll('svg')) {
    letters = Math.min(letters, 12 * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width);
    for (const use of svg.querySelectorAll('use'))
      if (svg.closest("figure").querySelector('h3').textContent === 'Lines')
        mark = Math.min(mark, contrast(rgb(getComputedStyle(use).fill), below(use)));
  }
  const root = document.documentElement;
  parent.postMessage([matchMedia('(prefers-color-scheme: dark)').matches, root.scrollWidth - innerWidth,
    text, letters, mark].map(Number).join(' '), '*');
});
//]]></script>)js";

/// The page in a frame of this many pixels: a window of the browser itself is never narrower than
/// 500.
constexpr const char* kAround = R"(<!DOCTYPE html><html><body style="margin:0">
<script>addEventListener('message', (m) => { document.getElementById('said').textContent = m.data; });</script>
<iframe src="page.html" style="border:0;width:{}px;height:900px"></iframe><p id="said"></p></body></html>)";

Page some_page() {
  Page page;
  page.title = "A page that is looked at";
  page.lead = "A lead.";
  page.conditions = {{"Device", "llvmpipe (LLVM 15.0.6, 256 bits)"}, {"Run", "quick"}};
  Table table{"A wide table", "A note.", {}, {}};
  for (int c = 0; c < 12; ++c) table.columns.push_back({"column", "a long heading"});
  table.rows.push_back(std::vector<Cell>(12, number(1.2345678, 5)));
  Section first{"first", "First", "An answer in green.", {}};
  Chart chart;
  chart.title = "Lines";
  chart.x = {"Time (s)"}, chart.y = {"Error (mm)"};
  for (int n = 0; n < 8; ++n)
    chart.series.push_back({"series " + std::to_string(n),
                            {{1.0, 1.0 + n, "a", true}, {2.0, 2.0 + n, "b"}},
                            Line::kStraight});
  chart.guides = {{false, 3.0, "a goal"}};
  if (const auto svg = drawn(chart, "lines"))
    first.parts.push_back(Figure{"Lines", *svg, "Words.", table});
  HeatMap map;
  map.title = "A map";
  map.x = {"x"}, map.y = {"y"};
  map.x_values = {1, 2, 3}, map.y_values = {1, 2};
  map.panels = {{"", {0.0, 0.5, 1.0, std::nan(""), 0.2, 0.7}, {}}};
  map.bar.title = "share";
  if (const auto svg = drawn(map, "map"))
    first.parts.push_back(Figure{"A map", *svg, "Words.", table});
  first.parts.push_back(TablePart{table, false});
  first.parts.push_back(Note{"Something is missing.", true});
  page.sections = {first, {"second", "Second, with a longer name", "", {}}};
  return page;
}

struct Seen {
  bool ran = false;
  int error = 0;
  double dark = -1, overflow = 99, text_contrast = 0, letters_px = 0, mark_contrast = 0;
  double brightness = -1;  ///< mean of the picture, 0 to 255
};

double brightness_of(const fs::path& png) {
  cairo_surface_t* surface = cairo_image_surface_create_from_png(png.c_str());
  double sum = 0.0, count = 0.0;
  if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS) {
    const int height = cairo_image_surface_get_height(surface);
    const int row = cairo_image_surface_get_stride(surface);
    // Within the frame; there is nothing else to the left of it.
    for (int y = 0; y < std::min(height, 850); ++y)
      for (int x = 0; x < 4 * 380; ++x) {
        if (x % 4 == 3) continue;
        sum += cairo_image_surface_get_data(surface)[y * row + x], count += 1.0;
      }
  }
  cairo_surface_destroy(surface);
  return count > 0.0 ? sum / count : -1.0;
}

Seen look(const Page& page, bool dark, int width) {
  const ScratchFolder folder;
  std::string text = html(page);
  text.insert(text.rfind("</body>"), kMeasure);
  std::ofstream(folder.path() / "page.html") << text;
  std::string around = kAround;
  around.replace(around.find("{}"), 2, std::to_string(width));
  std::ofstream(folder.path() / "around.html") << around;
  const auto browser = [&](const std::string& what) {
    return call_program(
        {"chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
         "--virtual-time-budget=5000", "--user-data-dir=" + (folder.path() / "profile").string(),
         dark ? "--blink-settings=preferredColorScheme=0"
              : "--blink-settings=preferredColorScheme=1",
         "--window-size=1200,1000", what, "file://" + (folder.path() / "around.html").string()},
        folder.path() / "out", folder.path() / "complaints", {.seconds = 120.0});
  };
  Seen seen;
  seen.error = browser("--dump-dom");
  if (seen.error != 0) return seen;
  const std::string said = text_of(folder.path() / "out");
  const size_t at = said.find("<p id=\"said\">");
  if (at == std::string::npos) return seen;
  seen.ran = std::sscanf(said.c_str() + at + 13, "%lf %lf %lf %lf %lf", &seen.dark, &seen.overflow,
                         &seen.text_contrast, &seen.letters_px, &seen.mark_contrast) == 5;
  const fs::path picture = folder.path() / "seen.png";
  browser("--screenshot=" + picture.string());
  seen.brightness = brightness_of(picture);
  return seen;
}

TEST(Browser, FollowsTheSystemsColoursAndStaysReadableOnAPhone) {
  const Page page = some_page();
  ASSERT_EQ(page.sections[0].parts.size(), 4U) << "python3-matplotlib is not installed";
  for (const bool dark : {false, true})
    for (const int width : {400, 1100}) {
      const Seen seen = look(page, dark, width);
      if (seen.error == ENOENT) GTEST_SKIP() << "chromium is not installed";
      ASSERT_TRUE(seen.ran) << "chromium printed nothing; exit " << seen.error;
      SCOPED_TRACE(std::string(dark ? "dark" : "light") + ", " + std::to_string(width) + " px");
      EXPECT_EQ(seen.dark, dark ? 1.0 : 0.0);
      EXPECT_LE(seen.overflow, 0.0) << "the page is wider than its window";
      EXPECT_GE(seen.text_contrast, 4.5);
      // The colours for marks alone are light on white: their contrast there is 2.
      EXPECT_GE(seen.mark_contrast, dark ? 3.0 : 2.0);
      EXPECT_GE(seen.letters_px, 9.0) << "letters of plots are too small";
      if (dark)
        EXPECT_LT(seen.brightness, 70.0);
      else
        EXPECT_GT(seen.brightness, 200.0);
    }
}

}  // namespace
}  // namespace palpate::report
