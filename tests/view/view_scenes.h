#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "compute/volume/phantom.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "module/view/volume_renderer.h"
#include "tests/support/device.h"

namespace palpate::test {

/// A still volume: size^3 samples of spacing_mm, centred on the origin, of a function of the place
/// (volume space, mm).
inline std::shared_ptr<const MovingVolume> still_volume(
    int size, double spacing_mm, const std::function<double(glm::dvec3)>& value) {
  Volume volume;
  volume.grid.size = glm::ivec3(size);
  volume.grid.spacing_mm = glm::dvec3(spacing_mm);
  volume.grid.origin_mm = glm::dvec3(-0.5 * spacing_mm * (size - 1));
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        volume.values.push_back(
            float(value(1e3 * volume_from_lps(volume.grid.lps_from_index(glm::dvec3(i, j, k))))));
  MovingVolume moving;
  moving.name = "made";
  moving.times.times_s = {0.0};
  moving.frames = {sampled_scalar(std::move(volume))};
  return std::make_shared<const MovingVolume>(std::move(moving));
}

/// The built-in beating heart.
inline std::shared_ptr<const MovingVolume> beating_heart() {
  static const auto heart = std::make_shared<const MovingVolume>(*build(shell_scene().volumes[0]));
  return heart;
}

/// The motion of the shell over its frames, from frame `reference`: curves between them, or
/// (harmonics) their best first harmonic, which differs from the shell's own motion.
inline SequenceMotion shell_motion(const Grid& grid, const FrameTimes& times, size_t reference,
                                   bool harmonics) {
  const auto frames = int(times.times_s.size());
  SequenceMotion motion;
  motion.reference = reference;
  motion.basis = {times.times_s, times.cycle_s, harmonics ? 1 : 0};
  std::vector<Field> at;
  for (int k = 0; k < frames; ++k) at.push_back(shell_truth(grid, int(reference), k, frames));
  if (!harmonics) {
    motion.terms = std::move(at);
    return motion;
  }
  for (int n = 0; n < 3; ++n) {
    TimeWeights weights;
    weights.count = frames;
    for (int k = 0; k < frames; ++k) {
      const double angle = 2.0 * std::acos(-1.0) * k / frames;
      weights.term[size_t(k)] = k;
      weights.weight[size_t(k)] =
          float((n == 0 ? 1.0 : 2.0 * (n == 1 ? std::cos(angle) : std::sin(angle))) / frames);
    }
    motion.terms.push_back(combined(at, weights));
  }
  return motion;
}

/// The same with one motion for all times, which carries frame 1's values.
inline std::shared_ptr<const MovingVolume> carried_heart(bool harmonics) {
  const MovingVolume& own = *beating_heart();
  return std::make_shared<const MovingVolume>(
      *carried(own, shell_motion(heart_grid(64), own.times, 1, harmonics)));
}

/// Extinction that is proportional to the value: `per_mm` at 1, exact to 1e-4 between 0 and 1.
inline Look proportional_look(double per_mm) {
  Look look{"proportional", {}, {1.0, 0.0, 0.0}, 0.0};
  for (int k = 0; k <= 256; ++k)
    look.points.push_back({k / 256.0, glm::dvec3(1.0), 1.0 - std::exp(-per_mm * k / 256.0)});
  return look;
}

/// Opaque from `level` on, nothing below.
inline Look step_look(double level) {
  Look look{"step", {}, {1.0, 0.0, 0.0}, 0.0};
  look.points = {{level, glm::dvec3(1.0), 0.0}, {level, glm::dvec3(1.0), 0.999}};
  return look;
}

/// The direction of a pixel's ray, world, with a unit step in depth along the eye's axis.
inline glm::dvec3 ray_of(const Eye& eye, PictureSize size, int x, int y) {
  const double right = eye.tan_left + (x + 0.5) / size.width * (eye.tan_right - eye.tan_left);
  const double up = eye.tan_up - (y + 0.5) / size.height * (eye.tan_up - eye.tan_down);
  return eye.orientation * glm::dvec3(right, up, -1.0);
}

class ViewTest : public DeviceTest {
 protected:
  std::unique_ptr<VolumeRenderer> renderer(const RendererOptions& options) {
    auto made = VolumeRenderer::make(context(), options);
    EXPECT_TRUE(made) << made.error().message;
    return made ? std::move(*made) : nullptr;
  }

  /// Draws and reads back; fails the test with the renderer's error message.
  std::vector<Picture> draw(VolumeRenderer& renderer, const ViewScene& scene,
                            const std::vector<Eye>& eyes, PictureSize size) {
    std::vector<Picture> pictures;
    const Status started = renderer.start(scene, eyes, size);
    EXPECT_TRUE(started) << started.error().message;
    if (!started) return std::vector<Picture>(eyes.size());
    for (size_t e = 0; e < eyes.size(); ++e) {
      Result<Picture> picture = renderer.read_back(int(e));
      EXPECT_TRUE(picture) << picture.error().message;
      pictures.push_back(picture ? std::move(*picture) : Picture{});
    }
    return pictures;
  }

  void set(VolumeRenderer& renderer, std::vector<std::shared_ptr<const MovingVolume>> volumes) {
    const Status status = renderer.set_volumes(volumes);
    ASSERT_TRUE(status) << status.error().message;
  }
};

inline int channel(const Picture& picture, int x, int y, int c) {
  return int(picture.colours[size_t(y) * size_t(picture.width) + size_t(x)] >> (8 * c) & 255U);
}

/// The largest difference of red, green or blue.
inline int worst_channel(uint32_t a, uint32_t b) {
  int worst = 0;
  for (int c = 0; c < 24; c += 8)
    worst = std::max(worst, std::abs(int(a >> c & 0xffu) - int(b >> c & 0xffu)));
  return worst;
}

}  // namespace palpate::test
