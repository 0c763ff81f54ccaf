#include "module/view/thing_list.h"

#include <algorithm>
#include <cmath>

#include "module/scene/look.h"
#include "module/view/refill.h"
#include "shaders/interface/view.h"

namespace palpate::view {

using namespace view_shaders;

namespace {

/// Tangents between which a circle of a plane is seen, its centre `aside` and `ahead` of the eye.
/// False if it reaches behind the eye's plane.
bool seen_between(double aside, double ahead, double radius, double& low, double& high) {
  const double apart = std::hypot(aside, ahead);
  if (ahead <= radius || apart <= radius) return false;
  const double middle = std::atan2(aside, ahead), half = std::asin(radius / apart);
  if (std::abs(middle) + half >= 1.55) return false;
  low = std::min(low, std::tan(middle - half));
  high = std::max(high, std::tan(middle + half));
  return true;
}

}  // namespace

PixelBox pixels_of(const RoundCone& thing, const Eye& eye, PictureSize size, double near_m) {
  double left = 1e9, right = -1e9, down = 1e9, up = -1e9;
  bool in_front = true, behind = true;
  for (const auto& [place, radius] :
       {std::pair(thing.from, thing.from_radius_m), std::pair(thing.to, thing.to_radius_m)}) {
    const glm::dvec3 at = glm::conjugate(eye.orientation) * (place - eye.position_m);
    behind = behind && -at.z + radius < near_m;
    in_front = in_front && seen_between(at.x, -at.z, radius, left, right) &&
               seen_between(at.y, -at.z, radius, down, up);
  }
  if (behind) return {};
  if (!in_front) return {0, 0, size.width, size.height};
  const double per_x = size.width / (eye.tan_right - eye.tan_left);
  const double per_y = size.height / (eye.tan_up - eye.tan_down);
  // Clamped before the cast: a thing far aside has no pixel number that fits an int.
  const auto pixel = [](double at, int most) { return int(std::clamp(at, 0.0, double(most))); };
  const int x0 = pixel(std::floor((left - eye.tan_left) * per_x) - 1.0, size.width);
  const int x1 = pixel(std::ceil((right - eye.tan_left) * per_x) + 1.0, size.width);
  const int y0 = pixel(std::floor((eye.tan_up - up) * per_y) - 1.0, size.height);
  const int y1 = pixel(std::ceil((eye.tan_up - down) * per_y) + 1.0, size.height);
  if (x1 <= x0 || y1 <= y0) return {};
  return {x0, y0, x1 - x0, y1 - y0};
}

void ThingList::show(const Things& things, std::span<const Eye> eyes, PictureSize size,
                     double near_m) {
  std::vector<ViewThing> packed;
  std::vector<glm::uvec4> items;
  for (const RoundCone& thing : things) {
    const glm::dvec3 c = thing.colour;
    const glm::vec3 linear(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z));
    for (size_t e = 0; e < eyes.size(); ++e) {
      const PixelBox box = pixels_of(thing, eyes[e], size, near_m);
      for (int y = 0; y < box.height; y += kItemPixels)
        for (int x = 0; x < box.width; x += kItemPixels) {
          const int width = std::min(kItemPixels, box.width - x);
          const int height = std::min(kItemPixels, box.height - y);
          items.emplace_back(packed.size(), e, uint32_t(box.x + x) | uint32_t(box.y + y) << 16,
                             uint32_t(width) | uint32_t(height) << 16);
        }
    }
    packed.push_back({glm::vec4(thing.from, thing.from_radius_m),
                      glm::vec4(thing.to, thing.to_radius_m), glm::vec4(linear, 1.0F)});
  }
  item_count_ = int(items.size());
  refill(context_, packed, things_);
  refill(context_, items, items_);
}

void ThingList::record(vulkan::Recorder& recorder, Kernels& kernels, int pass,
                       const vulkan::Buffer& parameters, const vulkan::Buffer& depth,
                       const vulkan::Buffer& colour) const {
  if (item_count_ == 0) return;
  recorder.dispatch(kernels.things(pass), {parameters, things_, items_, depth, colour}, nullptr,
                    {item_count_, 1, 1});
}

}  // namespace palpate::view
