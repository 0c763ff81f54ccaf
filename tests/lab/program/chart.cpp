#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/app/outputs.h"
#include "integration/app/program.h"
#include "integration/files/atomic_file.h"
#include "integration/files/scene/json_object.h"
#include "integration/files/sentences.h"
#include "tests/lab/program/chart_study.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/studies/measuring.h"
#include "tests/lab/studies/other_load.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

// On two cores nothing is left out in these times, unless other programs use the cores.
constexpr double kFullMinutes = 18.0, kQuickMinutes = 5.0;

struct ChartCommand {
  std::vector<std::string> words;
  fs::path output = "chart.html", csv, data = "../shared/data", truth, mask;
  std::vector<fs::path> landmarks;
  DeviceOptions device;
  int runs = 0;
  double minutes = 0.0;
  bool quick = false, quiet = false;
};

std::string joined_studies() {
  std::string names;
  for (const ChartStudy& study : chart_studies()) names += (names.empty() ? "" : ", ") + study.word;
  return names;
}

/// The request on the command line.
struct Wish {
  std::vector<const ChartStudy*> studies;
  std::optional<bench::OwnPair> own;
};

Error bad(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

Result<bench::OwnPair> own_pair(const ChartCommand& command,
                                const std::vector<std::string>& files) {
  if (files.size() != 2) {
    std::vector<std::string_view> words = {};
    for (const ChartStudy& study : chart_studies()) words.push_back(study.word);
    if (const std::string near = files::nearest_word(files.front(), words); !near.empty())
      return bad(fmt::format("There is no study '{}': did you mean '{}'?", files.front(), near));
    return bad(
        fmt::format("There is no study '{}': name any of {}, or a pair of volumes FIXED "
                    "MOVING with --truth or --landmarks.",
                    files.front(), joined_studies()));
  }
  if (command.truth.empty() == command.landmarks.empty()) {
    return bad(
        "The error of a pair needs one thing that is known of its motion: give --truth FIELD "
        "or --landmarks FIXED.csv MOVING.csv.");
  }
  if (!command.mask.empty() && command.truth.empty())
    return bad("A mask says where a true field counts: give --truth with --mask.");
  return bench::OwnPair{files[0], files[1], command.truth, command.landmarks, command.mask};
}

Result<Wish> wish_of(const ChartCommand& command) {
  Wish wish;
  std::vector<std::string> files;
  const auto& all = chart_studies();
  const auto add = [&](const ChartStudy& study) {
    if (std::find(wish.studies.begin(), wish.studies.end(), &study) == wish.studies.end())
      wish.studies.push_back(&study);
  };
  for (const std::string& word : command.words) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const ChartStudy& s) { return s.word == word; });
    if (found != all.end()) {
      add(*found);
    } else {
      files.push_back(word);
    }
  }
  const bool extras = !command.truth.empty() || !command.landmarks.empty() || !command.mask.empty();
  if (!files.empty()) {
    auto own = own_pair(command, files);
    if (!own) return own.error();
    wish.own = std::move(*own);
    // A pair of the user's own is for the study of motion.
    if (wish.studies.empty()) add(all.front());
    if (std::find(wish.studies.begin(), wish.studies.end(), &all.front()) == wish.studies.end())
      return bad("A pair of volumes belongs to the study 'motion': name it too.");
  } else if (extras) {
    return bad("--truth, --landmarks and --mask go with a pair of volumes: name FIXED and MOVING.");
  }
  if (wish.studies.empty())
    for (const ChartStudy& study : all)
      if (study.by_default) add(study);
  return wish;
}

std::vector<report::Table> tables_of(const report::Page& page) {
  std::vector<report::Table> tables;
  for (const report::Section& section : page.sections) {
    for (const report::Part& part : section.parts) {
      if (const auto* figure = std::get_if<report::Figure>(&part)) {
        report::Table table = figure->data;
        table.title = section.id + " " + figure->title;
        if (!table.rows.empty()) tables.push_back(std::move(table));
      } else if (const auto* table = std::get_if<report::TablePart>(&part)) {
        tables.push_back(table->table);
        tables.back().title = section.id + " " + table->table.title;
      }
    }
  }
  return tables;
}

Status write_csv(const fs::path& folder, const report::Page& page) {
  auto outputs = Outputs::into(folder);
  if (!outputs) return outputs.error();
  for (const report::Table& table : tables_of(page)) {
    const auto path = outputs->stage(report::file_stem(table.title) + ".csv");
    if (!path) return path.error();
    if (const Status written = files::write_text(*path, report::flat_csv(table)); !written)
      return outputs->in_place(written.error());
  }
  return outputs->publish();
}

report::Page page_of(const ChartCommand& command, const vulkan::Context& context) {
  report::Page page;
  page.title = "palpate: speed against accuracy";
  page.lead =
      "What palpate costs on this machine, and how good the result is. Every number and every "
      "sentence in green comes from this run.";
  const vulkan::GpuInfo& info = context.info();
  page.conditions = {{"Device", info.name},
                     {"Driver", info.driver},
                     {"CPU threads", std::to_string(std::thread::hardware_concurrency())},
                     {"Program", "palpate " PALPATE_VERSION},
                     {"Date", fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(std::time(nullptr)))},
                     {"Run", command.quick ? "quick: small data, few settings" : "full"}};
  return page;
}

/// Runs the studies one after the other under one progress bar.
Status measure(const Wish& wish, ChartJob& job, report::Page& page) {
  const double end_s = job.run.end_s;
  double whole = 0.0, done = 0.0;
  std::string now;
  for (const ChartStudy* study : wish.studies) whole += study->share;
  for (const ChartStudy* study : wish.studies) {
    const double begin = studies::now_s();
    // The time that one study does not use is for the later ones.
    job.run.end_s = begin + std::max(0.0, end_s - begin) * study->share / (whole - done);
    job.run.progress = [&](double share, const std::string& doing) {
      now = doing;
      job.console->progress((done + share * study->share) / whole, doing);
    };
    auto section = study->run(job);
    // Half of a study may not be enough to draw, but that is not the reason for the end.
    if (job.run.stop.stop_requested()) {
      return Error{ErrorKind::kCancelled,
                   fmt::format("Stopped at '{}'; no report was written", now)};
    }
    if (!section) return section.error();
    done += study->share;
    job.console->say(fmt::format("{:<10}{}", study->word, duration_text(studies::now_s() - begin)));
    page.sections.push_back(std::move(*section));
  }
  job.console->progress(1.0, "done");
  job.console->end_progress();
  return Nothing{};
}

int run(const ChartCommand& command) {
  Console console(command.quiet, false, Steps::kLines);
  const CancelOnSignal cancel;
  const auto wish = wish_of(command);
  if (!wish) return fail(console, wish.error());
  if (const Status can = files::check_can_write_file(command.output); !can)
    return fail(console, can.error());
  if (!command.csv.empty())
    if (const Status can = files::check_can_write_folder(command.csv); !can)
      return fail(console, can.error());
  if (const Status can = report::check_plots(); !can) return fail(console, can.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());

  ChartJob job;
  job.run.context = *context;
  job.run.quick = command.quick;
  job.run.runs = command.runs > 0 ? command.runs : command.quick ? 2 : 3;
  job.run.stop = cancel.token();
  const double minutes = command.minutes > 0.0 ? command.minutes
                         : command.quick       ? kQuickMinutes
                                               : kFullMinutes;
  job.run.end_s = studies::now_s() + 60.0 * minutes;
  job.data = command.data;
  job.own = wish->own;
  job.console = &console;
  report::Page page = page_of(command, **context);
  const studies::OtherLoad others;
  const double begin = studies::now_s();
  if (const Status done = measure(*wish, job, page); !done) return fail(console, done.error());
  page.conditions.emplace_back("Took", duration_text(studies::now_s() - begin));
  if (const std::string sentence = others.sentence(); !sentence.empty())
    page.conditions.emplace_back("Meanwhile", sentence.substr(1));

  Status written = files::write_text(command.output, report::html(page));
  if (written && !command.csv.empty()) written = write_csv(command.csv, page);
  if (!written) return fail(console, written.error());
  for (const report::Section& section : page.sections)
    console.say(fmt::format("\n{}\n{}", section.title, section.answer));
  console.say(fmt::format("\nWrote     {}", command.output.string()));
  return kExitOk;
}

int run_and_say(const ChartCommand& command) {
  try {
    return run(command);
  } catch (const studies::Mismatch& mismatch) {
    fmt::print(stderr, "palpate-lab: {}\n", mismatch.what());
  } catch (const vulkan::Failure& failure) {
    fmt::print(stderr, "palpate-lab: {}\n", failure.error().message);
  }
  return kExitInternal;
}

}  // namespace

Command add_chart(CLI::App& program) {
  auto command = std::make_shared<ChartCommand>();
  std::string about = "What to measure, any of";
  for (const ChartStudy& study : chart_studies())
    about += fmt::format("\n{} ({})", study.word, study.about);
  CLI::App* app = program.add_subcommand(
      "chart", "Chart speed against accuracy on this machine, as one HTML file");
  app->add_option("what", command->words, about + ";\nand a pair of volumes FIXED MOVING");
  app->add_option("--truth", command->truth, "The pair's true field")
      ->type_name("FILE")
      ->check(an_existing_file());
  app->add_option("--mask", command->mask, "Where the truth counts")
      ->type_name("FILE")
      ->check(an_existing_file());
  app->add_option("--landmarks", command->landmarks, "Points in FIXED, and the same in MOVING")
      ->type_name("FILE")
      ->expected(2)
      ->check(an_existing_file());
  app->add_flag("--quick", command->quick,
                "Small data and few settings: a minute or two on two quiet cores");
  app->add_option("-o,--out", command->output, "The report, .html")
      ->type_name("FILE")
      ->capture_default_str();
  app->add_option("--csv", command->csv, "Folder for all tables as CSV")->type_name("DIR");
  app->add_option("--data", command->data, "Folder with lung/, the real CT in known motion")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--runs", command->runs,
                  "Timed runs, of which the median counts (default: 3, quick: 2)")
      ->check(whole_number_in(1, 100));
  app->add_option("--minutes", command->minutes,
                  fmt::format("About how long it may take; what does not fit is left out and named "
                              "in the report (default: {:g}, quick: {:g})",
                              kFullMinutes, kQuickMinutes))
      ->check(number_in({0.1, 10000.0}));
  add_device_options(*app, command->device);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command] { return run_and_say(*command); },
          {"what", "--truth", "--mask", "--landmarks", "--data"},
          {"--out", "--csv"},
          {}};
}

}  // namespace palpate::app
