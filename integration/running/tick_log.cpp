#include "integration/running/tick_log.h"

#include <fmt/format.h>

#include <algorithm>

#include "compute/volume/open_file.h"
#include "compute/vulkan/caught.h"
#include "integration/files/sentences.h"

namespace palpate::running {
namespace {

constexpr const char* kHeader =
    "t_s,dt_s,force_x_n,force_y_n,force_z_n,wanted_x_n,wanted_y_n,wanted_z_n,probe_x_m,probe_y_m,"
    "probe_z_m,proxy_x_m,proxy_y_m,proxy_z_m,frame_and_phase,contact,frozen,newton_steps,"
    "residual_m,scene_energy_j,cause,device_fault,hand_work_j,asked_x_n,asked_y_n,asked_z_n";

/// The header's line: after the columns above three for each limiter, with '_' for '-', and the
/// torque.
std::string header() {
  std::string line = kHeader;
  for (size_t k = 0; k < kLimiters; ++k) {
    std::string name = word(Limiter(k));
    std::replace(name.begin(), name.end(), '-', '_');
    for (const char axis : {'x', 'y', 'z'}) line += fmt::format(",{}_{}_n", name, axis);
  }
  return line + ",torque_x_n_m,torque_y_n_m,torque_z_n_m\n";
}

}  // namespace

Result<std::unique_ptr<TickLog>> TickLog::start(const std::filesystem::path& csv) {
  auto log = std::unique_ptr<TickLog>(new TickLog);
  log->path_ = csv;
  if (!csv.empty()) {
    log->file_.reset(open_file(csv, "w"));
    if (!log->file_) return files::bad_output(csv, "can not be written: name a place that can");
    log->failed_ = std::fputs(header().c_str(), log->file_.get()) < 0;
  }
  return log;
}

void TickLog::hear(const TickInput& input, const TickOutput& output) noexcept {
  if (!any_) first_ns_ = input.now_ns;
  any_ = true;
  TickRow row;
  row.time_s = double(input.now_ns - first_ns_) * 1e-9;
  row.dt_s = input.dt_s;
  row.force_n = output.command.force_n;
  row.wanted_n = output.wanted_n;
  row.probe_m = output.probe_m;
  row.proxy_m = output.proxy_m;
  row.pointer = output.first.frame + output.first.phase;
  row.residual_m = output.residual_m;
  row.scene_energy_j = output.scene_energy_j;
  row.cause = output.cause;
  row.fault = output.fault;
  row.newton_steps = output.newton_steps;
  row.in_contact = output.command.in_contact;
  row.frozen = output.frozen;
  counter_.add(row, output.ledger, output.hand_work_j);
  history_.add(row);
  // The memory may be full.
  if (file_)
    failed_ |= !caught([&]() -> Status {
      write(row, output);
      return Nothing{};
    });
}

void TickLog::write(const TickRow& r, const TickOutput& output) {
  std::string line = fmt::format(
      "{:.6f},{:.6f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},"
      "{:.7f},{:.5f},{:d},{:d},{},{:.3e},{:.3e},{},{},{:.7g}",
      r.time_s, r.dt_s, r.force_n.x, r.force_n.y, r.force_n.z, r.wanted_n.x, r.wanted_n.y,
      r.wanted_n.z, r.probe_m.x, r.probe_m.y, r.probe_m.z, r.proxy_m.x, r.proxy_m.y, r.proxy_m.z,
      r.pointer, r.in_contact, r.frozen, r.newton_steps, r.residual_m, r.scene_energy_j,
      word(r.cause), int(r.fault), output.hand_work_j);
  // As many digits as a double needs, so that who adds them up finds the force to its last digit.
  const auto add = [&line](glm::dvec3 n) { line += fmt::format(",{},{},{}", n.x, n.y, n.z); };
  add(output.ledger.asked_n);
  for (const glm::dvec3& held : output.ledger.held_n) add(held);
  add(output.command.torque_n_m);
  line += '\n';
  failed_ |= std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size();
}

Status TickLog::finish() {
  if (!file_) return Nothing{};
  failed_ |= std::fclose(file_.release()) != 0;
  if (failed_)
    return files::bad_output(path_, "is not complete: the disk or the memory may be full");
  return Nothing{};
}

}  // namespace palpate::running
