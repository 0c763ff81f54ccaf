// The number of harmonics that a cycle needs, for sequences whose motion is known or of which
// frames were left out. A row per number: the unsteadiness of the values at material points
// relative to no smoothing (which the estimation uses for its choice), the error, and whether this
// number was chosen.
#include <fmt/format.h>

#include <numbers>
#include <optional>
#include <random>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/quality.h"
#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/files/read_volume.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/rows.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::app {
namespace {

using report::number;
using report::words;
namespace fs = std::filesystem;

struct HarmonicsCommand {
  fs::path data = "../shared/data";
  std::string only;
  bool once = false;
  DeviceOptions device;
  RowFiles rows;
};

struct HarmonicsCase {
  std::string name;
  std::vector<Volume> frames;
  std::vector<double> times_s;
  /// The error of a motion: mm, or 100 % minus the Dice overlap.
  std::function<double(const SequenceMotion&)> error;
};

/// Mean distance to the truth at every n-th voxel of a mask, from the reference to all frames.
double mean_error_mm(const SequenceMotion& motion, const Mask& mask,
                     const std::function<glm::dvec3(glm::dvec3, size_t from, size_t to)>& truth) {
  double sum = 0.0;
  size_t count = 0, seen = 0;
  std::vector<Field> at_frame;
  for (size_t k = 0; k < motion.frames(); ++k) at_frame.push_back(motion.at_frame(k));
  const Grid& grid = mask.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        if (!mask.values[grid.offset(i, j, k)] || seen++ % 11 != 0) continue;
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        for (size_t f = 0; f < motion.frames(); ++f) {
          if (f == motion.reference) continue;
          sum += glm::distance(x + sample_at_lps(at_frame[f], x), truth(x, motion.reference, f));
          ++count;
        }
      }
  return sum / double(count);
}

HarmonicsCase phantom(bool heart, int frames, double noise, int size) {
  const Grid grid = heart_grid(size);
  Sequence made =
      heart ? heart_phantom(grid, frames, 3, noise) : shell_phantom(grid, frames, 3, noise);
  HarmonicsCase one{fmt::format("{}-{}f-noise{:g}", heart ? "heart" : "shell", frames, noise),
                    std::move(made.frames),
                    std::move(made.times_s),
                    {}};
  one.error = [=](const SequenceMotion& motion) {
    const int r = int(motion.reference);
    const Mask mask = heart ? heart_muscle(grid, r, frames, 3) : shell_mask(grid, r, frames, 3);
    return mean_error_mm(motion, mask, [=](glm::dvec3 x, size_t from, size_t to) {
      return heart ? heart_point(x, int(from), int(to), frames)
                   : shell_point(x, int(from), int(to), frames);
    });
  };
  return one;
}

/// The known motion of a pair as a cycle: frame k contains moving(x + s_k truth(x)).
std::optional<HarmonicsCase> from_pair(const std::string& name, const fs::path& moving_file,
                                       const fs::path& truth_file, const fs::path& mask_file,
                                       int frames, bool uneven_breath, double noise_share) {
  const auto moving = files::read_volume(moving_file);
  const auto truth = files::read_field(truth_file);
  const auto mask = files::read_mask(mask_file);
  if (!moving || !truth || !mask) return std::nullopt;
  const auto [low, high] = std::minmax_element(moving->values.begin(), moving->values.end());
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.0F, float(noise_share * (double(*high) - *low)));
  HarmonicsCase one{
      fmt::format("{}-{}f{}", name, frames, uneven_breath ? "-uneven" : ""), {}, {}, {}};
  std::vector<double> shares;
  for (int k = 0; k < frames; ++k) {
    const double phase = double(k) / frames;
    const double s =
        std::pow(std::sin(std::numbers::pi * std::pow(phase, uneven_breath ? 1.6 : 1.0)), 2.0);
    shares.push_back(s);
    one.times_s.push_back(phase);
    Volume frame{moving->grid, std::vector<float>(moving->values.size())};
    const Grid& grid = frame.grid;
    for (int z = 0; z < grid.size.z; ++z)
      for (int y = 0; y < grid.size.y; ++y)
        for (int x = 0; x < grid.size.x; ++x) {
          const glm::dvec3 at = grid.lps_from_index({x, y, z});
          const glm::dvec3 from = at + s * sample_at_lps(*truth, at);
          frame.values[grid.offset(x, y, z)] =
              float(sample(*moving, grid.index_from_lps(from))) + noise(random);
        }
    one.frames.push_back(std::move(frame));
  }
  one.error = [truth = *truth, mask = *mask, shares](const SequenceMotion& motion) {
    return mean_error_mm(motion, mask, [&](glm::dvec3 x, size_t from, size_t to) {
      const glm::dvec3 material = x + shares[from] * sample_at_lps(truth, x);
      glm::dvec3 y = material;
      for (int step = 0; step < 60; ++step) y = material - shares[to] * sample_at_lps(truth, y);
      return y;
    });
  };
  return one;
}

/// Every n-th frame of the beating heart. The error: the label of the reference frame carried to
/// the frames that were left out (to all, if none was).
std::optional<HarmonicsCase> cine(const fs::path& shared, size_t every) {
  HarmonicsCase one{fmt::format("cine-every-{}", every), {}, {}, {}};
  std::vector<Volume> labels;
  std::vector<double> all_times;
  for (size_t k = 0; k < 20; ++k) {
    all_times.push_back(double(k) / 20.0);
    auto label = files::read_volume(shared / fmt::format("heart_cine/lv_{:02}.mha", k));
    if (!label) return std::nullopt;
    labels.push_back(std::move(*label));
    if (k % every != 0) continue;
    auto frame = files::read_volume(shared / fmt::format("heart_cine/frame_{:02}.mha", k));
    if (!frame) return std::nullopt;
    one.frames.push_back(std::move(*frame));
    one.times_s.push_back(all_times.back());
  }
  one.error = [labels, all_times, every](const SequenceMotion& motion) {
    const Volume& reference = labels[motion.reference * every];
    const Grid& grid = reference.grid;
    double lack = 0.0;
    size_t count = 0;
    for (size_t k = 0; k < 20; ++k) {
      if (k == motion.reference * every || (every > 1 && k % every == 0)) continue;
      const Field u = motion.at(all_times[k]);
      double both[3] = {}, all[3] = {};
      for (int z = 2; z <= 12; ++z)
        for (int y = 0; y < grid.size.y; ++y)
          for (int x = 0; x < grid.size.x; ++x) {
            const glm::dvec3 at = grid.lps_from_index({x, y, z});
            const glm::dvec3 there = grid.index_from_lps(at + sample_at_lps(u, at));
            const int here = int(reference.at(x, y, z));
            const glm::ivec3 i =
                glm::clamp(glm::ivec3(glm::round(there)), glm::ivec3(0), grid.size - 1);
            const int carried = int(labels[k].at(i.x, i.y, i.z));
            if (here > 2 || carried > 2) continue;
            ++all[here];
            ++all[carried];
            if (here == carried) both[here] += 2.0;
          }
      lack += 100.0 * (2.0 - both[1] / all[1] - both[2] / all[2]) / 2.0;
      ++count;
    }
    return lack / double(count);
  };
  return one;
}

/// What the harmonics leave of the motion, weighted root mean squares.
struct Misfit {
  double left_mm = 0.0;
  double left_out_mm = 0.0;  ///< of each frame by a fit to the others
};

Misfit misfit_of(const SequenceMotion& motion, const std::vector<Field>& at_frame,
                 const std::vector<Confidence>& confidence) {
  Misfit misfit;
  size_t count = 0;
  const double own = double(2 * motion.basis.harmonics + 1) / double(at_frame.size());
  for (size_t k = 0; k < at_frame.size(); ++k) {
    const Field fit = motion.at_frame(k);
    for (size_t n = 0; n < fit.u_mm.size(); ++n) {
      const double w = confidence[k].values[n];
      const double d = glm::distance(fit.u_mm[n], at_frame[k].u_mm[n]);
      misfit.left_mm += w * d * d;
      misfit.left_out_mm += w * d * d / ((1.0 - own) * (1.0 - own));
      ++count;
    }
  }
  misfit.left_mm = std::sqrt(misfit.left_mm / double(count));
  misfit.left_out_mm = std::sqrt(misfit.left_out_mm / double(count));
  return misfit;
}

/// Root mean square of the second difference in time, mm.
double acceleration_of(const SequenceMotion& motion) {
  double acceleration = 0.0;
  size_t count = 0;
  const size_t frames = motion.frames();
  for (size_t k = 0; k < frames; ++k) {
    const Field before = motion.at_frame((k + frames - 1) % frames), now = motion.at_frame(k),
                after = motion.at_frame((k + 1) % frames);
    for (size_t n = 0; n < now.u_mm.size(); ++n, ++count)
      acceleration +=
          std::pow(double(glm::length(before.u_mm[n] - 2.0F * now.u_mm[n] + after.u_mm[n])), 2.0);
  }
  return std::sqrt(acceleration / double(count));
}

report::Table measure(const std::shared_ptr<vulkan::Context>& context, const HarmonicsCase& one,
                      bool cyclic) {
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("balanced");
  options.estimator.cyclic = cyclic;
  SequenceReport report;
  const FrameReader read = [&](size_t k) -> Result<Volume> { return one.frames[k]; };
  const auto chosen = estimate_sequence_motion(context, one.frames[0].grid, one.times_s, read,
                                               options, {}, {}, {}, &report);
  if (!chosen) throw studies::Mismatch(one.name + ": " + chosen.error().message);
  report::Table table{one.name,
                      "",
                      {{"harmonics", "harmonics"},
                       {"unsteady", "unsteady"},
                       {"error", "error"},
                       {"left_mm", "left, mm"},
                       {"left_out_mm", "left out, mm"},
                       {"acceleration", "acceleration"},
                       {"chosen", "chosen"}},
                      {}};
  for (const std::string& note : report.notes) table.note += note + " ";
  // Without smoothing; every number of harmonics is a fit to this.
  options.steadiness = -1.0;
  const auto plain =
      estimate_sequence_motion(context, one.frames[0].grid, one.times_s, read, options);
  if (!plain) throw studies::Mismatch(one.name + ": " + plain.error().message);
  std::vector<Field> at_frame;
  for (size_t k = 0; k < plain->frames(); ++k) at_frame.push_back(plain->at_frame(k));
  for (size_t h = 0; h < report.unsteadiness.size(); ++h) {
    SequenceMotion motion = *plain;
    Misfit misfit;
    if (h > 0) {
      motion.basis.harmonics = int(h);
      motion.terms = harmonics_of(at_frame, motion.basis);
      misfit = misfit_of(motion, at_frame, report.confidence);
    }
    table.rows.push_back({number(double(h), 0),
                          number(report.unsteadiness[h] / report.unsteadiness[0], 4),
                          number(one.error(motion), 4), number(misfit.left_mm, 4),
                          number(misfit.left_out_mm, 4), number(acceleration_of(motion), 3),
                          words(int(h) == chosen->basis.harmonics ? "chosen" : "")});
  }
  return table;
}

using MakeCase = std::function<std::optional<HarmonicsCase>()>;

std::vector<std::pair<std::string, MakeCase>> all_cases(const fs::path& data) {
  std::vector<std::pair<std::string, MakeCase>> cases;
  for (const bool heart : {true, false})
    for (const int frames : {6, 8, 12, 20, 30})
      for (const double noise : {0.02, 0.1})
        cases.emplace_back(heart ? "heart" : "shell",
                           [=] { return std::optional(phantom(heart, frames, noise, 64)); });
  for (const size_t every : {1, 2, 3})
    cases.emplace_back("cine", [=] { return cine(data, every); });
  for (const bool uneven : {false, true})
    for (const int frames : {8, 14}) {
      cases.emplace_back("lung", [=] {
        return from_pair("lung", data / "lung/pair_moving.mha", data / "lung/pair_truth.mha",
                         data / "lung/pair_body.mha", frames, uneven, 0.01);
      });
      for (const char* pair : {"thoraxmr_heart", "spineus_bspline", "bodypet_breathing"})
        cases.emplace_back(pair, [=] {
          const fs::path folder = data / "kit" / pair;
          return from_pair(pair, folder / "moving.mha", folder / "truth.mha", folder / "mask.mha",
                           frames, uneven, 0.02);
        });
    }
  return cases;
}

int run(const HarmonicsCommand& command) {
  Console console(false, false);
  if (const Status can = check_can_write(command.rows); !can) return fail(console, can.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  Rows rows("harmonics", context->get());
  for (const auto& [name, make] : all_cases(command.data))
    if (name.starts_with(command.only))
      if (const auto one = make()) rows.add([&] { return measure(*context, *one, !command.once); });
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_harmonics(CLI::App& program) {
  auto command = std::make_shared<HarmonicsCommand>();
  CLI::App* app =
      program.add_subcommand("harmonics", "Measure what each number of harmonics of a cycle costs");
  app->add_option("--data", command->data, "Folder with lung/, kit/ and heart_cine/")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--only", command->only, "Cases whose name begins like this");
  app->add_flag("--once", command->once, "Not taken for a cycle");
  add_device_options(*app, command->device);
  add_row_options(*app, command->rows);
  return {app,
          [command] { return measured([&] { return run(*command); }); },
          {"--data"},
          row_outputs(),
          {}};
}

}  // namespace palpate::app
