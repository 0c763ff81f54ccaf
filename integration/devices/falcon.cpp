#include "integration/devices/falcon.h"

#include <fstream>
#include <iterator>
#include <vector>

#include "integration/devices/falcon_kinematics.h"
#include "integration/devices/falcon_worker.h"

namespace palpate::devices {
namespace {

// The images that are known have 8 to 9 thousand bytes.
constexpr size_t kLargestImage = 1 << 20;

Result<std::vector<uint8_t>> read_firmware(const std::string& path) {
  if (path.empty()) return std::vector<uint8_t>();
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes(kLargestImage + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  bytes.resize(size_t(file.gcount()));
  if (bytes.empty())
    return Error{ErrorKind::kBadInput, path +
                                           " can not be read as firmware: it is not there, not "
                                           "readable or empty."};
  if (bytes.size() > kLargestImage)
    return Error{ErrorKind::kBadInput,
                 path + " is too large for a Falcon's firmware, which has about 8 kB."};
  return bytes;
}

}  // namespace

DeviceInfo falcon_info() {
  DeviceInfo info;
  info.kind = "falcon";
  info.name = "Novint Falcon";
  info.max_force_n = falcon::kForceEverywhere;
  info.max_stiffness_n_per_m = 3000.0;  // what CHAI3D gives it with
  info.workspace_centre_m = falcon::kWorkspaceCentre;
  info.workspace_radius_m = falcon::kWorkspaceRadius;
  info.resolution_m = falcon::kResolutionAtCentre;
  info.buttons = 4;
  return info;
}

Result<std::unique_ptr<FalconDevice>> FalconDevice::make(const FalconOptions& options) {
  auto firmware = read_firmware(options.firmware_file);
  if (!firmware) return firmware.error();
  return std::unique_ptr<FalconDevice>(
      new FalconDevice(std::make_unique<Worker>(options, std::move(*firmware))));
}

FalconDevice::FalconDevice(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}

FalconDevice::~FalconDevice() = default;

DeviceInfo FalconDevice::info() const {
  return worker_->info();
}

DeviceReading FalconDevice::exchange(const DeviceCommand& command) noexcept {
  return worker_->exchange(command);
}

FalconCounts FalconDevice::counts() const noexcept {
  return worker_->counts();
}

}  // namespace palpate::devices
