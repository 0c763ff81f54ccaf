#include "tests/lab/program/peers.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>

#include <fmt/format.h>

#include "integration/files/raster/write_volume.h"
#include "integration/files/read_volume.h"
#include "integration/opencv/slice_flow.h"
#include "tests/lab/program/beside.h"
#include "tests/lab/program/peer_scripts.h"
#include "tests/lab/report/child.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using studies::PairResult;

Error bad(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

unsigned threads() {
  return std::max(1U, std::thread::hardware_concurrency());
}

/// A program that reads two files and writes a field.
class FilePeer : public studies::PairMethod {
 public:
  FilePeer(std::string name, std::string family)
      : name_(std::move(name)), family_(std::move(family)) {}
  std::string name() const override { return name_; }
  std::string family() const override { return family_; }

  Result<PairResult> run(const Volume& fixed, const Volume& moving,
                         const report::Patience& patience) override {
    const report::ScratchFolder folder;
    if (folder.path().empty()) return bad("no temporary folder can be made: is the disk full?");
    const Job job{folder.path(), folder.path() / "fixed.mha", folder.path() / "moving.mha",
                  patience};
    for (const auto& [volume, file] : {std::pair(&fixed, &job.fixed), {&moving, &job.moving}})
      if (const Status written = files::write_volume(*volume, *file); !written)
        return written.error();
    const auto seconds = register_files(job);
    if (!seconds) return seconds.error();
    auto field = files::read_field(field_file(job));
    if (!field) return field.error();
    return PairResult{std::move(*field), *seconds};
  }

 protected:
  struct Job {
    fs::path folder, fixed, moving;
    report::Patience patience;
  };
  virtual Result<double> register_files(const Job& job) = 0;
  virtual fs::path field_file(const Job& job) const { return job.folder / "field.mha"; }

  /// Runs a step; returns the seconds that it took.
  Result<double> step(const Job& job, const std::vector<std::string>& arguments) const {
    const fs::path out = job.folder / "out";
    const double begin = studies::now_s();
    const int failed = report::call_program(arguments, out, out, job.patience);
    if (failed == ENOENT) return bad(arguments.front() + " is not installed.");
    if (failed == ECANCELED) return Error{ErrorKind::kCancelled, "Stopped."};
    if (failed == ETIMEDOUT) {
      return Error{ErrorKind::kCancelled,
                   fmt::format("it was ended after {:.0f} s, more than there is time for.",
                               job.patience.seconds)};
    }
    if (failed != 0) {
      const std::string said = report::text_of(out);
      return bad(fmt::format("{} failed: {}", arguments.front(),
                             said.substr(said.size() - std::min<size_t>(said.size(), 200))));
    }
    return studies::now_s() - begin;
  }

 private:
  std::string name_, family_;
};

class ItkPeer final : public FilePeer {
 public:
  ItkPeer(std::string name, std::string method, std::string iterations, fs::path program)
      : FilePeer(std::move(name), "ITK"),
        method_(std::move(method)),
        iterations_(std::move(iterations)),
        program_(std::move(program)) {}

 private:
  Result<double> register_files(const Job& job) override {
    const auto done =
        step(job, {program_.string(), method_, iterations_, std::to_string(threads()),
                   job.fixed.string(), job.moving.string(), field_file(job).string()});
    if (!done) return done.error();
    // It prints the time of the registration alone, without files, which is fairer than the
    // process's time.
    const double seconds = std::strtod(report::text_of(job.folder / "out").c_str(), nullptr);
    if (!(seconds > 0.0)) return bad("palpate_itk_peer said no time.");
    return seconds;
  }
  std::string method_, iterations_;
  fs::path program_;
};

class ElastixPeer final : public FilePeer {
 public:
  ElastixPeer() : FilePeer("elastix, B-splines", "elastix, plastimatch") {}

 private:
  Result<double> register_files(const Job& job) override {
    const std::string parameters = (job.folder / "parameters.txt").string();
    std::ofstream(parameters) << kElastixParameters;
    const auto done =
        step(job, {"elastix", "-f", job.fixed.string(), "-m", job.moving.string(), "-out",
                   job.folder.string(), "-p", parameters, "-threads", std::to_string(threads())});
    if (!done) return done.error();
    const auto written = step(
        job, {"transformix", "-def", "all", "-tp",
              (job.folder / "TransformParameters.0.txt").string(), "-out", job.folder.string()});
    if (!written) return written.error();
    return *done;
  }
  fs::path field_file(const Job& job) const override { return job.folder / "deformationField.mha"; }
};

class PlastimatchPeer final : public FilePeer {
 public:
  PlastimatchPeer() : FilePeer("plastimatch, B-splines", "elastix, plastimatch") {}

 private:
  Result<double> register_files(const Job& job) override {
    const std::string commands = (job.folder / "commands.txt").string();
    std::ofstream(commands) << fmt::format(kPlastimatchCommands, job.fixed.string(),
                                           job.moving.string(), field_file(job).string());
    return step(job, {"plastimatch", "register", commands});
  }
};

class FlowPeer final : public studies::PairMethod {
 public:
  explicit FlowPeer(opencv::FlowMethod method) : method_(method) {}
  Result<PairResult> run(const Volume& fixed, const Volume& moving,
                         const report::Patience& patience) override {
    auto flow = opencv::slice_flow(method_, fixed, moving, patience.stop);
    if (!flow) return flow.error();
    return PairResult{std::move(flow->field), flow->seconds};
  }
  std::string name() const override {
    return opencv::name(method_) + std::string(" flow on slices");
  }
  std::string family() const override { return "OpenCV"; }

 private:
  opencv::FlowMethod method_;
};

}  // namespace

std::unique_ptr<studies::PairMethod> itk_peer(const ItkFilter& filter, const char* iterations) {
  const auto program = program_beside("palpate_itk_peer");
  if (!program) return nullptr;
  const bool few = std::string(iterations) == kItkFew;
  return std::make_unique<ItkPeer>(filter.name + std::string(few ? ", few iterations" : ""),
                                   filter.method, iterations, *program);
}

Result<double> itk_demons_iteration_s(int size) {
  const auto program = program_beside("palpate_itk_peer");
  if (!program) return bad("palpate_itk_peer is not beside palpate-lab: build it too.");
  const report::ScratchFolder folder;
  const fs::path out = folder.path() / "out";
  const int failed = report::call_program(
      {program->string(), "rate", std::to_string(size), std::to_string(threads())}, out, out);
  const double seconds = std::strtod(report::text_of(out).c_str(), nullptr);
  if (failed == 0 && seconds > 0.0) return seconds;
  return bad("palpate_itk_peer said no time: " + report::text_of(out));
}

std::vector<std::unique_ptr<studies::PairMethod>> motion_peers(bool quick,
                                                               std::vector<std::string>& missing) {
  std::vector<std::unique_ptr<studies::PairMethod>> peers;
  for (const ItkFilter& filter : kItkFilters)
    for (const char* iterations : {kItkFew, kItkLong})
      if (auto peer = quick && iterations == kItkLong ? nullptr : itk_peer(filter, iterations))
        peers.push_back(std::move(peer));
  if (peers.empty())
    missing.push_back(
        "ITK was not measured: its program palpate_itk_peer is not beside palpate-lab (cmake "
        "--build build --target palpate_itk_peer).");
  for (const auto method : {opencv::FlowMethod::kDis, opencv::FlowMethod::kFarneback})
    peers.push_back(std::make_unique<FlowPeer>(method));
  if (quick) {
    missing.push_back("elastix and plastimatch take too long for a quick run: leave out --quick.");
    return peers;
  }
  if (on_path("elastix") && on_path("transformix")) {
    peers.push_back(std::make_unique<ElastixPeer>());
  } else {
    missing.push_back("elastix was not measured: it is not installed (apt-get install elastix).");
  }
  if (on_path("plastimatch")) {
    peers.push_back(std::make_unique<PlastimatchPeer>());
  } else {
    missing.push_back(
        "plastimatch was not measured: it is not installed (apt-get install plastimatch).");
  }
  return peers;
}

std::vector<studies::ViewMeasure> view_peer(const studies::StudyRun& run,
                                            std::vector<std::string>& missing) {
  std::vector<studies::ViewMeasure> rows;
  const auto program = program_beside("view_peer");
  if (run.quick) {
    missing.push_back("VTK draws too slowly for a quick run: leave out --quick.");
    return rows;
  }
  if (!program || !on_path("xvfb-run")) {
    missing.push_back(
        "VTK was not measured: its program view_peer is not beside palpate-lab, or xvfb-run is not "
        "installed (apt-get install libvtk9-dev xvfb xauth, then build again).");
    return rows;
  }
  const report::ScratchFolder folder;
  const fs::path out = folder.path() / "out";
  // xvfb-run leaves its temporary files behind if it is ended: here they are removed with the
  // folder.
  const int failed = report::call_program({"env", "TMPDIR=" + folder.path().string(), "xvfb-run",
                                           "-a", "-s", "-screen 0 1024x768x24", program->string()},
                                          out, out, {run.stop, run.left_s()});
  std::istringstream lines(report::text_of(out));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    studies::ViewMeasure row;
    double seconds = 0.0;
    std::string mapper;
    if (!(words >> row.look >> row.samples_per_voxel >> seconds >> row.quality_db >> mapper))
      continue;
    row.family = fmt::format("VTK, {} mapper", mapper);
    row.time_ms = 1e3 * seconds;
    rows.push_back(row);
  }
  if (failed == ETIMEDOUT) {
    missing.push_back(
        fmt::format("VTK was ended before it had drawn all its pictures: {} of them are here. More "
                    "time: --minutes.",
                    rows.size()));
  } else if (rows.empty()) {
    missing.push_back("VTK was not measured: view_peer drew nothing.");
  }
  return rows;
}

}  // namespace palpate::app
