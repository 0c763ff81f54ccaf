// Pages for browsers: what is inside them, read back by the readers of files; and one in a real
// browser, Debian's chromium, headless.
#include "integration/web/web_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "integration/files/atomic_file.h"
#include "integration/files/frames.h"
#include "integration/web/embedded.h"
#include "tests/files/temporary_folder.h"
#include "tests/lab/report/child.h"

namespace palpate::web {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

#define NEEDS_NIIVUE() \
  if (embedded(Embedded::kNiiVue).empty()) GTEST_SKIP() << "palpate was built without NiiVue"

Grid oblique_grid() {
  Grid grid;
  grid.size = {9, 7, 5};
  grid.spacing_mm = {0.8, 0.9, 5.0};
  grid.origin_mm = {-20.0, 31.0, 4.0};
  const double c = std::cos(0.3), s = std::sin(0.3);
  grid.direction = glm::dmat3(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
  return grid;
}

/// Two frames whose middle changes from dark to bright, an overlay in the first one, and labels.
WebPage some_page() {
  WebPage page;
  page.title = "Title <b> & </script>";
  page.subtitle = "two frames";
  page.verdict = "suspect";
  page.reasons = {"a reason"};
  page.frame_labels = {"frame 0, 0 ms", "frame 1, 40 ms"};
  page.frame_times = {0.0, 40.0};
  page.play_times_s = {0.0, 0.04};
  page.period_s = 0.08;
  WebVolume frames;
  frames.title = "value";
  frames.colormap = "gray";
  frames.low = -100.0;
  frames.high = 155.0;
  frames.grid = oblique_grid();
  std::vector<float> values(frames.grid.count());
  for (size_t n = 0; n < values.size(); ++n) values[n] = float(n % 50) - 100.0F;
  frames.frames.push_back(codes_of(values, frames.low, frames.high));
  for (float& value : values) value += 200.0F;
  frames.frames.push_back(codes_of(values, frames.low, frames.high));
  WebVolume overlay = frames;
  overlay.role = VolumeRole::kOverlay;
  overlay.title = "motion";
  overlay.colormap = "plasma";
  overlay.frames.resize(1);
  WebVolume labels = frames;
  labels.role = VolumeRole::kLabels;
  labels.title = "segments";
  labels.labels = {{1, "wall", {213, 94, 0}}, {2, "blood", {0, 114, 178}}};
  for (auto& frame : labels.frames)
    for (size_t n = 0; n < frame.size(); ++n) frame[n] = uint8_t(n % 9 / 3);
  page.volumes = {frames, overlay, labels};
  page.plots = {{"Motion (mm)", "ms", true, true, {{"mean", {0.0, 40.0}, {1.0, NAN}}}}};
  page.facts = {{"Preset", "fast"}};
  return page;
}

std::string text_of_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The text between two others, first occurrence.
std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const size_t begin = text.find(before);
  if (begin == std::string::npos) return "";
  const size_t from = begin + before.size();
  return text.substr(from, text.find(after, from) - from);
}

std::string bytes_of_base64(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | uint32_t(letters.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += char(bits >> count & 255);
    }
  }
  return bytes;
}

TEST(WebPage, CodesAreRoundedAndClamped) {
  EXPECT_THAT(codes_of({-1.0F, 0.0F, 0.499F, 0.501F, 255.0F, 300.0F, NAN, INFINITY}, 0.0, 255.0),
              ElementsAre(0, 0, 0, 1, 255, 255, 0, 0));
}

TEST(WebPage, FineVolumesAreHalvedAndTheMeanStays) {
  Grid grid;
  grid.size = {64, 64, 20};
  grid.spacing_mm = {1.0, 1.0, 4.0};
  EXPECT_TRUE(page_grids(grid, 2, 2.0 * 64 * 64 * 20).empty());
  const std::vector<Grid> steps = page_grids(grid, 2, 20'000.0);
  ASSERT_EQ(steps.size(), 2U);
  // The slices stay: they are far apart already.
  EXPECT_EQ(steps[0].size, glm::ivec3(32, 32, 20));
  EXPECT_EQ(steps[1].size, glm::ivec3(16, 16, 20));
  Volume ramp{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) ramp.values[grid.offset(i, j, k)] = float(i * i + 3 * j);
  const Volume small = reduced(ramp, steps);
  double sum = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) sum += double(ramp.at(8 + i, 20 + j, 3));
  EXPECT_NEAR(double(small.at(2, 5, 3)), sum / 16.0, 1e-3);
}

TEST(WebPage, VolumesComeBackWhereTheyWereAndAsTheyWere) {
  NEEDS_NIIVUE();
  const files::TemporaryFolder folder;
  const WebPage page = some_page();
  const fs::path file = folder / "page.html";
  ASSERT_TRUE(write_web_page(page, file));
  const auto data =
      nlohmann::json::parse(between(text_of_file(file), "id=\"palpate-data\">", "</script>"));
  ASSERT_EQ(data["volumes"].size(), 3U);
  for (size_t n = 0; n < 3; ++n) {
    const fs::path nifti = folder / "volume.nii.gz";
    std::ofstream(nifti, std::ios::binary)
        << bytes_of_base64(data["volumes"][n]["nifti"].get<std::string>());
    const WebVolume& volume = page.volumes[n];
    auto read = files::open_frames({nifti});
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->count, volume.frames.size());
    const Grid& grid = read->grid;
    EXPECT_EQ(grid.size, volume.grid.size);
    for (const glm::dvec3 at :
         {glm::dvec3(0.0), glm::dvec3(8.0, 0.0, 0.0), glm::dvec3(1.0, 6.0, 4.0)})
      EXPECT_LT(glm::length(grid.lps_from_index(at) - volume.grid.lps_from_index(at)), 1e-4);
    for (size_t k = 0; k < volume.frames.size(); ++k) {
      const auto frame = read->read(k);
      ASSERT_TRUE(frame) << frame.error().message;
      for (size_t v = 0; v < volume.frames[k].size(); ++v) {
        const double code = volume.frames[k][v];
        const double value = volume.role == VolumeRole::kLabels
                                 ? code
                                 : volume.low + code * (volume.high - volume.low) / 255.0;
        ASSERT_NEAR(double(frame->values[v]), value, 1e-4) << n << " " << k << " " << v;
      }
    }
  }
  EXPECT_EQ(data["volumes"][2]["label_colors"]["labels"][2], "blood");
  EXPECT_TRUE(data["plots"][0]["curves"][0]["y"][1].is_null());
}

TEST(WebPage, NoTextLeavesItsElement) {
  NEEDS_NIIVUE();
  const files::TemporaryFolder folder;
  const fs::path file = folder / "page.html";
  ASSERT_TRUE(write_web_page(some_page(), file));
  const std::string text = text_of_file(file);
  EXPECT_THAT(between(text, "<title>", "</title>"), "Title &lt;b> &amp; &lt;/script>");
  const std::string data = between(text, "id=\"palpate-data\">", "</script>");
  EXPECT_EQ(nlohmann::json::parse(data)["title"], "Title <b> & </script>");
  EXPECT_THAT(data, Not(HasSubstr("<")));
  EXPECT_THAT(text, HasSubstr("BSD 2-Clause License"));
}

TEST(WebPage, NamesThatAreNoPagesAreRefused) {
  NEEDS_NIIVUE();
  const files::TemporaryFolder folder;
  const Status picture = write_web_page(some_page(), folder / "page.png");
  ASSERT_FALSE(picture);
  EXPECT_THAT(picture.error().message, HasSubstr("name it .html"));
  EXPECT_FALSE(write_web_page(some_page(), folder.path() / "missing" / "page.html"));
}

/// Says what a person would see: dark or not, pixels by which the page is wider than its window,
/// volumes, frame after its slider was moved. Then mean brightness of the viewer in frame 0 and
/// in that frame, and whether it plays.
constexpr const char* kMeasure = R"js(<script>
(async () => {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  while (document.body.dataset.ready !== 'yes') await wait(20);
  const nv = window.palpateViewer;
  const brightness = () => {
    nv.drawScene();
    const gl = nv.gl, pixels = new Uint8Array(4 * gl.canvas.width * gl.canvas.height);
    gl.readPixels(0, 0, gl.canvas.width, gl.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels.reduce((sum, value, n) => sum + (n % 4 === 3 ? 0 : value), 0) / pixels.length;
  };
  const overlay = document.querySelector('select[aria-label=Overlay]');
  overlay.value = '-1';
  overlay.dispatchEvent(new Event('change'));
  const first = brightness();
  const slider = document.getElementById('frame');
  slider.value = 1;
  slider.dispatchEvent(new Event('input'));
  const second = brightness(), shown = nv.volumes[0].frame4D;
  let seen = new Set();
  // Without a screen, nothing asks for pictures.
  window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 5);
  document.getElementById('play').click();
  for (let n = 0; n < 40; ++n) { await wait(10); seen.add(slider.value); }
  document.getElementById('play').click();
  const root = document.documentElement;
  parent.postMessage([matchMedia('(prefers-color-scheme: dark)').matches, root.scrollWidth - innerWidth,
    nv.volumes.length, shown, first, second, seen.size].map(Number).join(' '), '*');
})();
</script>)js";

/// The page in two frames of these many pixels: a window of the browser itself is never narrower
/// than 500.
constexpr const char* kFrames = R"(<!DOCTYPE html><html><body style="margin:0">
<script>addEventListener('message', (m) => { document.getElementById('said').textContent += m.data + ';'; });</script>
<iframe src="page.html" style="border:0;width:400px;height:900px"></iframe>
<iframe src="page.html" style="border:0;width:1280px;height:900px"></iframe><p id="said"></p></body></html>)";

TEST(PageInABrowser, PlaysOnAPhoneAndOnAWideScreenInTheDark) {
  NEEDS_NIIVUE();
  const files::TemporaryFolder folder;
  const fs::path file = folder / "page.html";
  ASSERT_TRUE(write_web_page(some_page(), file));
  std::string text = text_of_file(file);
  text.insert(text.rfind("</body>"), kMeasure);
  ASSERT_TRUE(files::write_text(file, text));
  ASSERT_TRUE(files::write_text(folder / "around.html", kFrames));
  const int error = report::call_program(
      {"chromium", "--headless", "--no-sandbox", "--hide-scrollbars", "--use-angle=swiftshader",
       "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--virtual-time-budget=5000",
       "--user-data-dir=" + (folder.path() / "profile").string(),
       "--blink-settings=preferredColorScheme=0", "--window-size=1700,1000", "--dump-dom",
       "file://" + (folder.path() / "around.html").string()},
      folder / "out", folder / "complaints", {.seconds = 120.0});
  if (error == ENOENT) GTEST_SKIP() << "chromium is not installed";
  std::istringstream said(between(text_of_file(folder / "out"), "<p id=\"said\">", "</p>"));
  int pages = 0;
  for (std::string line; std::getline(said, line, ';'); ++pages) {
    SCOPED_TRACE(line);
    double dark = -1, overflow = 99, volumes = 0, shown = 0, first = 0, second = 0, frames = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf %lf %lf %lf %lf", &dark, &overflow, &volumes,
                          &shown, &first, &second, &frames),
              7);
    EXPECT_EQ(dark, 1.0);
    EXPECT_LE(overflow, 0.0) << "the page is wider than its window";
    EXPECT_EQ(volumes, 3.0);
    EXPECT_EQ(shown, 1.0);
    EXPECT_GT(second, first + 5.0) << "the second frame is brighter";
    EXPECT_EQ(frames, 2.0) << "both frames are seen while it plays";
  }
  EXPECT_EQ(pages, 2) << "exit " << error << ", " << text_of_file(folder / "complaints");
}

}  // namespace
}  // namespace palpate::web
