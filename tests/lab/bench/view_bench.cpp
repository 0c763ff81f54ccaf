// What a picture costs: against VTK's GPU ray caster on the same device, and against what it has to
// cost. Each picture is first compared with one of eight samples per voxel, then timed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <sstream>

#include "bench_commit.h"
#include "module/scene/make_volume.h"
#include "module/view/volume_renderer.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/view_case.h"

namespace palpate::bench {
namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Frames 1 and 2 of the heart with their true motion, not cyclic.
std::shared_ptr<const MovingVolume> view_volume(int size) {
  Sequence frames = shell_phantom(heart_grid(size), 4, 1, 0.0);
  MovingVolume volume;
  volume.name = "heart";
  volume.times.times_s = {0.0, 0.25};
  for (const size_t k : {1, 2})
    volume.frames.push_back(sampled_scalar(std::move(frames.frames[k])));
  volume.motions.push_back(
      {"data", {MotionMap::of(shell_truth(coarsened(heart_grid(size), glm::ivec3(2)), 1, 2, 4))}});
  return std::make_shared<const MovingVolume>(std::move(volume));
}

/// The same with one motion for both times, which carries the first frame's values.
std::shared_ptr<const MovingVolume> carried_volume(const MovingVolume& own, int size) {
  // The grid that the estimator solves on.
  const Grid grid = coarsened(heart_grid(size), glm::ivec3(4));
  SequenceMotion motion;
  motion.basis = {own.times.times_s, 0.0, 0};
  motion.terms = {still_field(grid), shell_truth(grid, 1, 2, 4)};
  return std::make_shared<const MovingVolume>(*carried(own, motion));
}

/// One way of drawing, and what came of it.
struct Shot {
  Look look;
  double samples_per_voxel = 1.0;
  std::vector<Eye> eyes;
  bool counts = false;
};
struct Outcome {
  double seconds = 0.0;  ///< median
  std::vector<unsigned char> pixels;
  ViewStatistics statistics;
};

class Bench {
 public:
  Bench(std::shared_ptr<vulkan::Context> context, std::shared_ptr<const MovingVolume> volume,
        int runs)
      : context_(std::move(context)), volume_(std::move(volume)), runs_(runs) {}

  Outcome draw(const Shot& shot, int runs) const {
    RendererOptions options{kViewSize, 2};
    options.samples_per_voxel = shot.samples_per_voxel;
    options.count_samples = shot.counts;
    auto made = VolumeRenderer::make(context_, options);
    VolumeRenderer& renderer = **made;
    const std::vector volumes{volume_};
    expect(renderer.set_volumes(volumes));
    ViewScene scene;
    scene.volumes = {{volume_, {}, {}, shot.look}};
    std::vector<double> times;
    // The first one compiles kernels and makes the bricks, the second one meets warm memory.
    for (int run = -2; run < runs; ++run) {
      const double start = seconds();
      expect(renderer.start(scene, shot.eyes, kViewSize));
      expect(renderer.wait());
      if (run >= 0) times.push_back(seconds() - start);
    }
    Outcome outcome;
    std::sort(times.begin(), times.end());
    if (!times.empty()) outcome.seconds = times[times.size() / 2];
    outcome.statistics = renderer.statistics();
    for (size_t eye = 0; eye < shot.eyes.size(); ++eye) {
      const Result<Picture> picture = renderer.read_back(int(eye));
      for (const uint32_t colour : picture->colours)
        for (int shift = 0; shift < 24; shift += 8)
          outcome.pixels.push_back(static_cast<unsigned char>(colour >> shift));
    }
    return outcome;
  }

  Outcome timed(const Shot& shot) const { return draw(shot, runs_); }

  /// Medians of pictures at another phase than the one before, and of the same picture again: in
  /// turn, so that other load meets both.
  std::pair<double, double> moving_and_still(const std::shared_ptr<const MovingVolume>& volume,
                                             const Look& look, const std::vector<Eye>& eyes) const {
    auto made = VolumeRenderer::make(context_, {kViewSize, 2});
    VolumeRenderer& renderer = **made;
    expect(renderer.set_volumes(std::vector{volume}));
    ViewScene scene;
    scene.volumes = {{volume, {}, {}, look}};
    std::vector<double> moving, still;
    for (int run = -1; run < runs_; ++run) {
      scene.volumes[0].pointer.phase = 0.3 + 0.01 * (run + 1);
      for (std::vector<double>* times : {&moving, &still}) {
        const double start = seconds();
        expect(renderer.start(scene, eyes, kViewSize));
        expect(renderer.wait());
        if (run >= 0) times->push_back(seconds() - start);
      }
    }
    std::sort(moving.begin(), moving.end());
    std::sort(still.begin(), still.end());
    return {moving[moving.size() / 2], still[still.size() / 2]};
  }

  /// The coarsest rate that is good enough, 0 if none is, and how good it is.
  std::pair<double, double> rate_for(const Look& look, const std::vector<Eye>& eyes) const {
    const std::vector<unsigned char> reference = draw({look, 8.0, eyes, false}, 0).pixels;
    for (const double rate : kRates) {
      const double quality_db = psnr_db(draw({look, rate, eyes, false}, 0).pixels, reference);
      if (quality_db >= kEnoughDb) return {rate, quality_db};
    }
    return {0.0, 0.0};
  }

 private:
  static void expect(const Status& status) {
    if (!status) throw std::runtime_error(status.error().message);
  }
  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<const MovingVolume> volume_;
  int runs_;
};

/// What the peer measured, by look: rate, seconds, dB. Empty where it was not built or has no
/// display.
struct PeerRow {
  double rate = 0.0, seconds = 0.0, quality_db = 0.0;
};

std::map<std::string, PeerRow> run_peer(const std::string& beside) {
  std::map<std::string, PeerRow> rows;
  const std::filesystem::path peer = std::filesystem::path(beside).parent_path() / "view_peer";
  if (!std::filesystem::exists(peer)) return rows;
  const std::string command = "xvfb-run -a -s '-screen 0 1024x768x24' " + peer.string() + " 2>&1";
  std::FILE* out = popen(command.c_str(), "r");
  if (!out) return rows;
  char line[256];
  while (std::fgets(line, sizeof line, out)) {
    std::istringstream words(line);
    std::string look;
    PeerRow row;
    if (words >> look >> row.rate >> row.seconds >> row.quality_db) rows[look] = row;
  }
  pclose(out);
  return rows;
}

Table against_peer(const Bench& bench, const std::string& program) {
  Table table{"Pictures against VTK 9.1's GPU ray caster on the same device",
              "2 x 512^2 pixels of 256^3 voxels, shaded. Each at the fewest samples per voxel that "
              "reach 40 dB against its own picture of eight samples per voxel.",
              {{"look", "look"},
               {"samples_per_voxel", "samples/voxel"},
               {"psnr_db", "dB"},
               {"time_ms", "ms"},
               {"peer_samples_per_voxel", "VTK samples/voxel"},
               {"peer_psnr_db", "VTK dB"},
               {"peer_time_ms", "VTK ms"},
               {"ratio", "VTK/palpate"}},
              {}};
  const auto both = view_eyes();
  const std::vector<Eye> eyes(both.begin(), both.end());
  const OtherLoad load;
  const std::map<std::string, PeerRow> peer = run_peer(program);
  for (const bool dense : {false, true}) {
    const Look look = view_look(dense);
    const auto [rate, quality_db] = bench.rate_for(look, eyes);
    const double time_s = bench.timed({look, rate, eyes, false}).seconds;
    std::vector<Cell> row{words(look.name), number(rate, 2), number(quality_db, 1),
                          number(1e3 * time_s, 1)};
    if (const auto found = peer.find(look.name); found != peer.end()) {
      row.push_back(number(found->second.rate, 2));
      row.push_back(number(found->second.quality_db, 1));
      row.push_back(number(1e3 * found->second.seconds, 1));
      row.push_back(number(found->second.seconds / time_s, 1));
    } else {
      row.insert(row.end(), 4, nothing());
    }
    table.rows.push_back(std::move(row));
  }
  table.note += load.sentence();
  if (peer.empty()) table.note += " VTK or Xvfb was not found, so it was not measured.";
  return table;
}

Table costs(const Bench& bench, const std::shared_ptr<const MovingVolume>& volume,
            const std::shared_ptr<const MovingVolume>& carried) {
  Table table{"What a picture costs",
              "2 x 512^2 pixels of 256^3 voxels, one sample per voxel. Needed are samples with "
              "extinction where more than 1 % of the light is left. Moving: every picture at "
              "another phase, beside the same picture again. Carried: one frame's values, by one "
              "motion for all times. Inside: the eyes in the middle of the heart.",
              {{"look", "look"},
               {"taken_per_needed", "samples taken/needed"},
               {"mono_ms", "mono ms"},
               {"stereo_ms", "stereo ms"},
               {"stereo_per_mono", "stereo/mono"},
               {"moving_ms", "moving ms"},
               {"moving_per_still", "moving/still"},
               {"carried_still_ms", "carried still ms"},
               {"carried_moving_ms", "carried moving ms"},
               {"carried_moving_per_still", "carried moving/still"},
               {"inside_ms", "inside ms"},
               {"inside_per_far", "inside/far"}},
              {}};
  const auto far = view_eyes(), inside = view_eyes({0.0, 0.0, 0.001});
  const std::vector<Eye> eyes(far.begin(), far.end()), within(inside.begin(), inside.end());
  const OtherLoad load;
  std::vector<Look> looks{view_look(false), view_look(true), *preset_look("phantom")};
  looks.back().name = "opaque wall";
  for (const Look& look : looks) {
    const ViewStatistics counted = bench.draw({look, 1.0, eyes, true}, 0).statistics;
    const double mono = bench.timed({look, 1.0, {eyes[0]}, false}).seconds;
    const double stereo = bench.timed({look, 1.0, eyes, false}).seconds;
    const auto [moving, still] = bench.moving_and_still(volume, look, eyes);
    const auto [carried_moving, carried_still] = bench.moving_and_still(carried, look, eyes);
    const double close = bench.timed({look, 1.0, within, false}).seconds;
    table.rows.push_back({words(look.name),
                          number(double(counted.samples_taken) / double(counted.samples_needed), 2),
                          number(1e3 * mono, 1), number(1e3 * stereo, 1), number(stereo / mono, 2),
                          number(1e3 * moving, 1), number(moving / still, 2),
                          number(1e3 * carried_still, 1), number(1e3 * carried_moving, 1),
                          number(carried_moving / carried_still, 2), number(1e3 * close, 1),
                          number(close / stereo, 2)});
  }
  table.note += load.sentence();
  return table;
}

int run(const std::string& device, int runs, int size, bool with_peer, const std::string& program) {
  vulkan::ContextOptions options;
  options.device = device;
  auto context = vulkan::Context::open(options);
  if (!context) throw std::runtime_error(context.error().message);
  fmt::print("{}, {}, commit {}\n\n", (*context)->info().name, (*context)->info().driver,
             kLabCommit);
  const auto volume = view_volume(size);
  const Bench bench(*context, volume, runs);
  if (with_peer) {
    fmt::print("{}\n", plain_text(against_peer(bench, program)));
    std::fflush(stdout);
  }
  fmt::print("{}\n", plain_text(costs(bench, volume, carried_volume(*volume, size))));
  return 0;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  std::string device;
  int runs = 5, size = 256;
  bool with_peer = true;
  CLI::App app("What pictures of volumes cost");
  app.add_option("--gpu,--device", device, "Number or part of the name of the Vulkan device");
  app.add_option("--runs", runs, "Timed runs, of which the median counts")
      ->check(CLI::Range(1, 1000));
  app.add_option("--size", size, "Voxels along each axis (VTK draws 256)")
      ->check(CLI::Range(32, 1024));
  app.add_flag("--peer,!--no-peer", with_peer, "Beside VTK, too");
  CLI11_PARSE(app, argc, argv);
  try {
    return palpate::bench::run(device, runs, size, with_peer, argv[0]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "view_bench: {}\n", error.what());
    return 1;
  }
}
