#include "tests/view/slow_rays.h"

#include <cmath>
#include <limits>

#include "compute/volume/parallel.h"
#include "tests/view/shown_value.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

/// Light that a volume emits and the share of light that it transmits.
struct Light {
  glm::dvec3 colour{0.0};
  double through = 1.0;
};

class SlowRay {
 public:
  SlowRay(const ViewVolume& volume, glm::dvec3 light)
      : volume_(volume), frame_(*volume.data->frames[0]), light_(light) {}

  double value(glm::dvec3 world) const {
    return felt_value(*volume_.data, volume_.pointer,
                      volume_.world_from_volume.volume_from_world(world));
  }
  bool inside(glm::dvec3 world) const {
    const glm::dvec3 x = volume_.world_from_volume.volume_from_world(world);
    return glm::all(glm::greaterThan(x, frame_.low_m())) &&
           glm::all(glm::lessThan(x, frame_.high_m()));
  }
  /// Slope of the values as they are shown, per mm of volume space (not enlarged).
  glm::dvec3 slope(glm::dvec3 world) const {
    const double h = 0.5 * frame_.detail_m() * volume_.world_from_volume.scale.x;
    glm::dvec3 slope;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 aside(0.0);
      aside[a] = h;
      slope[a] = (value(world + aside) - value(world - aside)) /
                 (2e3 * h / volume_.world_from_volume.scale.x);
    }
    return slope;
  }
  /// The brightness of a place, and the highlight on it, from its slope and the direction to the
  /// eye.
  /// kept: the share of its extinction.
  void lit(glm::dvec3 slope, glm::dvec3 to_eye, double& light, double& shine, double& kept) const {
    const Look& look = volume_.look;
    const double steep = glm::length(slope);
    const double full = look.surface_slope > 0.0 ? look.surface_slope : 0.1 * width_of(look);
    const double surface = std::min(steep * steep / (full * full), 1.0);
    light = 1.0;
    shine = 0.0;
    kept = 1.0 - (1.0 - look.flat_opacity) * (1.0 - surface);
    if (!(steep > 0.0)) return;
    const glm::dvec3 n = slope / steep;
    const double side = glm::dot(n, to_eye) > 0.0 ? 1.0 : -1.0;
    const double diffuse = std::max(0.3 + 0.7 * side * glm::dot(n, light_), 0.0);
    const glm::dvec3 half = glm::normalize(to_eye + light_);
    light = 1.0 + surface * (look.shine.ambient + look.shine.diffuse * diffuse - 1.0);
    shine = surface * look.shine.specular * std::pow(std::max(side * glm::dot(n, half), 0.0), 32.0);
  }

  Light follow(glm::dvec3 from, glm::dvec3 way, double near, double far, double step_m,
               const std::vector<ClipPlane>& clips) const {
    Light light;
    for (double t = near + 0.5 * step_m; t < far && light.through > 1e-5; t += step_m) {
      const glm::dvec3 at = from + t * way;
      bool kept = inside(at);
      for (const ClipPlane& clip : clips) kept = kept && glm::dot(clip.normal, at) >= clip.offset_m;
      if (!kept) continue;
      const LookSample seen = look_at(volume_.look, value(at));
      if (!(seen.extinction_per_mm > 0.0)) continue;
      double bright = 1.0, shine = 0.0, passed = 1.0;
      lit(slope(at), -way, bright, shine, passed);
      // In an enlarged volume a millimetre is one of the volume's own space.
      const double mm = 1e3 * step_m / volume_.world_from_volume.scale.x;
      const double passes = std::exp(-passed * seen.extinction_per_mm * mm);
      light.colour += light.through * (1.0 - passes) * (seen.colour * bright + shine);
      light.through *= passes;
    }
    return light;
  }

 private:
  const ViewVolume& volume_;
  const FrameData& frame_;
  glm::dvec3 light_;
};

/// IEC 61966-2-1.
double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

uint32_t packed(glm::dvec3 linear, double covered) {
  uint32_t bits = uint32_t(std::lround(255.0 * covered)) << 24;
  for (int c = 0; c < 3; ++c)
    bits |= uint32_t(std::lround(255.0 * srgb_from_linear(std::clamp(linear[c], 0.0, 1.0))))
            << (8 * c);
  return bits;
}

}  // namespace

Picture slow_picture(const ViewScene& scene, const Eye& eye, PictureSize size,
                     double steps_per_voxel, double near_m) {
  const auto linear = [](glm::dvec3 c) {
    return glm::dvec3(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z));
  };
  const SlowRay ray(scene.volumes.at(0), eye.orientation * glm::normalize(scene.light));
  const FrameData& frame = *scene.volumes[0].data->frames[0];
  const double scale = scene.volumes[0].world_from_volume.scale.x;
  const double reach = scale * glm::distance(frame.low_m(), frame.high_m());
  const glm::dvec3 middle =
      scene.volumes[0].world_from_volume.world_from_volume(0.5 * (frame.low_m() + frame.high_m()));
  const double apart = glm::distance(eye.position_m, middle);
  Picture picture{size.width, size.height, {}, {}};
  picture.colours.resize(size_t(size.width * size.height));
  parallel_ranges(size.height, 1e9, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < size.width; ++x) {
        const glm::dvec3 way = ray_of(eye, size, x, y);
        // Depth is along the eye's axis.
        const double stretch = glm::length(way);
        const Light light = ray.follow(
            eye.position_m, way / stretch, std::max(near_m * stretch, apart - 0.5 * reach),
            apart + 0.5 * reach, frame.detail_m() * scale / steps_per_voxel, scene.clips);
        const double down = (y + 0.5) / size.height;
        const glm::dvec3 behind =
            glm::mix(linear(scene.background_top), linear(scene.background_bottom), down);
        picture.colours[size_t(y * size.width + x)] =
            packed(light.colour + light.through * behind, 1.0 - light.through);
      }
  });
  return picture;
}

double psnr_db(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height) return 0.0;
  double squares = 0.0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const double d = channel(a, x, y, c) - channel(b, x, y, c);
        squares += d * d;
      }
  if (squares == 0.0) return std::numeric_limits<double>::infinity();
  return 10.0 * std::log10(255.0 * 255.0 * 3.0 * a.width * a.height / squares);
}

}  // namespace palpate::test
