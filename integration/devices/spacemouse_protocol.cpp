#include "integration/devices/spacemouse_protocol.h"

#include <algorithm>

namespace palpate::devices::spacemouse {
namespace {

// Ids as FreeSpacenav's spacenavd lists them. 046d is Logitech, which owned the maker once.
constexpr Model kModels[] = {
    {0x046d, 0xc603, "SpaceMouse Plus XT"},
    {0x046d, 0xc605, "CADMan"},
    {0x046d, 0xc606, "SpaceMouse Classic"},
    {0x046d, 0xc621, "SpaceBall 5000"},
    {0x046d, 0xc623, "SpaceTraveler"},
    {0x046d, 0xc625, "SpacePilot"},
    {0x046d, 0xc626, "SpaceNavigator"},
    {0x046d, 0xc627, "SpaceExplorer"},
    {0x046d, 0xc628, "SpaceNavigator for Notebooks"},
    {0x046d, 0xc629, "SpacePilot Pro"},
    {0x046d, 0xc62b, "SpaceMouse Pro"},
    {0x046d, 0xc640, "NuLOOQ"},
    {0x256f, 0xc62e, "SpaceMouse Wireless (cable)"},
    {0x256f, 0xc62f, "SpaceMouse Wireless (receiver)"},
    {0x256f, 0xc631, "SpaceMouse Pro Wireless (cable)"},
    {0x256f, 0xc632, "SpaceMouse Pro Wireless (receiver)"},
    {0x256f, 0xc633, "SpaceMouse Enterprise"},
    {0x256f, 0xc635, "SpaceMouse Compact"},
    {0x256f, 0xc636, "SpaceMouse Module"},
    {0x256f, 0xc638, "SpaceMouse Pro Wireless (Bluetooth model, cable)"},
    {0x256f, 0xc63a, "SpaceMouse Wireless (Bluetooth model, cable)"},
};

constexpr uint8_t kTranslation = 1, kRotation = 2, kButtons = 3;
constexpr size_t kThreeAxes = 1 + 6, kSixAxes = 1 + 12;

int axis(std::span<const uint8_t> report, size_t at) noexcept {
  return std::clamp<int>(int16_t(report[at] | report[at + 1] << 8), -kFull, kFull);
}

}  // namespace

std::span<const Model> models() noexcept {
  return kModels;
}

const Model* model_of(uint16_t vendor, uint16_t product) noexcept {
  for (const Model& model : kModels)
    if (model.vendor == vendor && model.product == product) return &model;
  return nullptr;
}

bool Reports::read(std::span<const uint8_t> report) noexcept {
  const uint8_t id = report.empty() ? 0 : report[0];
  if (id == kButtons && report.size() >= 2) {
    buttons_ = 0;
    const size_t bytes = std::min<size_t>(report.size() - 1, sizeof buttons_);
    for (size_t n = 0; n < bytes; ++n) buttons_ |= uint32_t(report[1 + n]) << (8 * n);
    return true;
  }
  if ((id == kTranslation || id == kRotation) && report.size() >= kThreeAxes) {
    const bool six = id == kTranslation && report.size() >= kSixAxes;
    const size_t first = id == kTranslation ? 0 : 3;
    for (size_t n = 0; n < (six ? 6 : 3); ++n) axes_[first + n] = axis(report, 1 + 2 * n);
    return true;
  }
  ++rejected_;
  return false;
}

glm::dvec3 speed(std::span<const int, 3> axes, int dead_zone, double full_speed) noexcept {
  const glm::dvec3 counts(axes[0], -axes[2], axes[1]);
  const double length = glm::length(counts);
  if (length <= dead_zone) return glm::dvec3(0.0);
  const double way = std::min(1.0, (length - dead_zone) / std::max(1, kFull - dead_zone));
  return counts * (full_speed * way * way / length);
}

}  // namespace palpate::devices::spacemouse
