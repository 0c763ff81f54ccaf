// The time of a picture and its quality, compared with VTK's two ray casters on the same machine;
// and how the time depends on the scene. Each picture is compared with one of eight samples per
// voxel.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>

#include "compute/vulkan/context.h"
#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "module/session/live_picture.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/peers.h"
#include "tests/lab/program/rows.h"
#include "tests/lab/studies/view_shot.h"
#include "tests/lab/studies/view_study.h"

namespace palpate::app {
namespace {

using report::number;
using report::words;
using namespace studies;

struct ViewCommand {
  int runs = 0, size = 0;
  bool quick = false, no_peer = false;
  DeviceOptions device;
  RowFiles rows;
};

/// One frame's values, carried by one motion for both times.
std::shared_ptr<const MovingVolume> carried_volume(const MovingVolume& own, int size) {
  // The grid that the estimator solves on.
  const Grid grid = coarsened(heart_grid(size), glm::ivec3(4));
  SequenceMotion motion;
  motion.basis = {own.times.times_s, 0.0, 0};
  motion.terms = {still_field(grid), shell_truth(grid, 1, 2, 4)};
  return std::make_shared<const MovingVolume>(*carried(own, motion));
}

/// Quality and time, the peer's rows after palpate's.
report::Table quality_table(const ViewCommand& command, const StudyRun& run) {
  std::vector<std::string> notes;
  std::vector<ViewMeasure> peers;
  if (!command.no_peer) peers = view_peer(run, notes);
  std::vector<ViewMeasure> all = measure_view(run, notes);
  std::move(peers.begin(), peers.end(), std::back_inserter(all));
  report::Table table = view_table(all);
  for (const std::string& sentence : view_sentences(all)) table.note += " " + sentence;
  for (const std::string& sentence : notes) table.note += " " + sentence;
  return table;
}

report::Table cost_table(const std::shared_ptr<vulkan::Context>& context, int size, int runs) {
  report::Table table{"What a picture costs",
                      fmt::format("2 x {0}^2 pixels of {1}^3 voxels, one sample per voxel. Needed "
                                  "are samples with extinction "
                                  "where more than 1 % of the light is left. Moving: every picture "
                                  "at another phase, beside "
                                  "the same picture again. Carried: one frame's values, by one "
                                  "motion for all times. Inside: "
                                  "the eyes in the middle of the heart.",
                                  kViewSize.width, size),
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
  const auto volume = beating(size);
  const auto carried_one = carried_volume(*volume, size);
  std::vector<Look> looks{view_look(false), view_look(true), *preset_look("phantom")};
  looks.back().name = "opaque wall";
  for (const Look& look : looks) {
    Shot stereo_shot{look};
    Shot mono_shot = stereo_shot, inside_shot = stereo_shot, counted_shot = stereo_shot;
    mono_shot.eyes.resize(1);
    inside_shot.eyes = both_view_eyes({0.0, 0.0, 0.001});
    counted_shot.counts = true;
    const auto seconds = [&](const Shot& shot) {
      return draw(context, volume, shot, runs).seconds;
    };
    const ViewStatistics counted = draw(context, volume, counted_shot, 0).statistics;
    const double mono = seconds(mono_shot), stereo = seconds(stereo_shot),
                 inside = seconds(inside_shot);
    const auto [moving, still] = moving_and_still(context, volume, look, runs);
    const auto [carried_moving, carried_still] = moving_and_still(context, carried_one, look, runs);
    const auto ms = [](double s) { return number(1e3 * s, 1); };
    table.rows.push_back({words(look.name),
                          number(double(counted.samples_taken) / double(counted.samples_needed), 2),
                          ms(mono), ms(stereo), number(stereo / mono, 2), ms(moving),
                          number(moving / still, 2), ms(carried_still), ms(carried_moving),
                          number(carried_moving / carried_still, 2), ms(inside),
                          number(inside / stereo, 2)});
  }
  return table;
}

/// The built-in heart, played in a window of the usual size without a display: how old a picture's
/// tick is when the picture is there.
report::Table window_table(int seconds) {
  report::Table table{"In the window",
                      "The beating heart as it is built in, one eye, the size of a new window, "
                      "drawn smaller where a picture takes longer than 40 ms; medians. From a tick "
                      "of the hand to the end of the picture that shows it, without the display.",
                      {{"voxels", "voxels"},
                       {"pictures_per_s", "pictures/s"},
                       {"width_px", "width, px"},
                       {"picture_ms", "picture ms"},
                       {"tick_to_picture_ms", "tick to picture ms"}},
                      {}};
  constexpr PictureSize kWindow{1120, 760};
  LoadedScene scene;
  scene.name = "heart";
  scene.spec = heart_scene();
  auto heart = build(scene.spec.volumes[0]);
  if (!heart) throw Mismatch(heart.error().message);
  const glm::ivec3 size = heart->frames[0]->samples().place->size;
  scene.data.push_back(std::make_shared<const MovingVolume>(std::move(*heart)));
  const auto transform = start_transform(scene.spec.volumes[0], *scene.data[0]);
  if (!transform) throw Mismatch(transform.error().message);
  scene.spec.volumes[0].transform = *transform;
  DeviceInfo device;
  device.kind = device.name = "bench";
  device.max_force_n = 8.0;
  device.workspace_radius_m = 0.1;
  auto session = Session::start_in_host(scene, device, {});
  if (!session) throw Mismatch(session.error().message);
  const auto now_ns = [] {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  std::jthread hand([&](const std::stop_token& stop) {
    for (int64_t next_ns = now_ns(); !stop.stop_requested(); next_ns += 1'000'000) {
      std::this_thread::sleep_until(
          std::chrono::steady_clock::time_point(std::chrono::nanoseconds(next_ns)));
      (*session)->tick({glm::dvec3(0.0, 0.0, 0.1), now_ns()});
    }
  });
  LivePicture live(**session, {});
  live.want({eye_at({0.1, 0.08, 0.28}, {0.0, 0.0, 0.0}, 0.6, kWindow), kWindow, 0.3, {}});
  std::vector<double> ages_ms, pictures_ms, widths;
  std::shared_ptr<const LiveFrame> last;
  // The first seconds go into compiling, uploading, and finding the size.
  const int64_t begin_ns = now_ns() + 4'000'000'000, end_ns = begin_ns + seconds * int64_t(1e9);
  while (now_ns() < end_ns && live.trouble().empty()) {
    auto newest = live.newest();
    if (newest != last && newest && now_ns() > begin_ns) {
      ages_ms.push_back(1e-6 * double(now_ns() - newest->snapshot.now_ns));
      pictures_ms.push_back(1e3 * newest->picture_s);
      widths.push_back(newest->picture->width);
    }
    last = std::move(newest);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  if (ages_ms.empty()) throw Mismatch("There was no picture: " + live.trouble());
  table.rows.push_back({words(fmt::format("{} x {} x {}", size.x, size.y, size.z)),
                        number(double(ages_ms.size()) / seconds, 1), number(median(widths), 0),
                        number(median(pictures_ms), 1), number(median(ages_ms), 1)});
  return table;
}

int run(const ViewCommand& command) {
  Console console(false, false);
  const CancelOnSignal cancel;
  if (const Status can = check_can_write(command.rows); !can) return fail(console, can.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  StudyRun study;
  study.context = *context;
  study.quick = command.quick;
  study.runs = command.runs > 0 ? command.runs : command.quick ? 1 : 5;
  study.stop = cancel.token();
  Rows rows("view", context->get());
  rows.add([&] { return quality_table(command, study); });
  const int size = command.size > 0 ? command.size : command.quick ? 64 : 256;
  if (study.stop.stop_requested())
    return fail(console, {ErrorKind::kCancelled, "Stopped before all was drawn"});
  rows.add([&] { return cost_table(*context, size, study.runs); });
  rows.add([&] { return window_table(command.quick ? 2 : 10); });
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_view(CLI::App& program) {
  auto command = std::make_shared<ViewCommand>();
  CLI::App* app = program.add_subcommand(
      "view", "Measure what pictures of volumes cost, VTK's two ray casters beside");
  app->add_option("--runs", command->runs,
                  "Timed runs, of which the median counts (default: 5, quick: 1)")
      ->check(whole_number_in(1, 1000));
  app->add_option("--size", command->size,
                  "Voxels along each axis in the table of costs (default: 256, quick: 64)")
      ->check(whole_number_in(32, 1024));
  app->add_flag("--quick", command->quick, "Small data and one run: does everything work?");
  app->add_flag("--no-peer", command->no_peer, "Leave VTK out");
  add_device_options(*app, command->device);
  add_row_options(*app, command->rows);
  return {
      app, [command] { return measured([&] { return run(*command); }); }, {}, row_outputs(), {}};
}

}  // namespace palpate::app
