#include "tests/lab/studies/view_shot.h"

#include <algorithm>

#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

template <class T>
T got(Result<T> result) {
  if (!result) throw Mismatch(result.error().message);
  return std::move(*result);
}

void expect(const Status& status) {
  if (!status) throw Mismatch(status.error().message);
}

/// Seconds of one picture.
double timed(VolumeRenderer& renderer, const ViewScene& scene, const std::vector<Eye>& eyes,
             PictureSize size) {
  const double begin = now_s();
  expect(renderer.start(scene, eyes, size));
  expect(renderer.wait());
  return now_s() - begin;
}

}  // namespace

std::shared_ptr<const MovingVolume> beating(int size) {
  Sequence frames = shell_phantom(heart_grid(size), 4, 1, 0.0);
  MovingVolume volume;
  volume.name = "heart";
  volume.times.times_s = {0.0, 0.25};
  for (const size_t k : {1, 2})
    volume.frames.push_back(sampled_scalar(std::move(frames.frames[k])));
  volume.motions.push_back(
      {"data", {MotionMap::of(shell_truth(coarsened(heart_grid(size), glm::ivec3(2)), 1, 2, 4))}});
  return std::make_shared<const MovingVolume>(std::move(volume));
}

Drawn draw(const std::shared_ptr<vulkan::Context>& context,
           const std::shared_ptr<const MovingVolume>& volume, const Shot& shot, int runs,
           const std::stop_token& stop) {
  const PictureSize size{shot.pixels, shot.pixels};
  RendererOptions options{size, 2};
  options.samples_per_voxel = shot.samples_per_voxel;
  options.skip_empty = shot.skip_empty;
  options.refines = shot.refines;
  options.smooth = shot.smooth;
  options.count_samples = shot.counts;
  const auto renderer = got(VolumeRenderer::make(context, options));
  expect(renderer->set_volumes(std::vector{volume}));
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, shot.look}};
  std::vector<double> seconds;
  // The first picture compiles kernels and makes the bricks; the second has warm memory. One is
  // drawn even after a stop request, so that there is always a picture.
  for (int n = -2; n == -2 || (n < std::max(runs, 0) && !stop.stop_requested()); ++n) {
    if (shot.moving) scene.volumes[0].pointer.phase = 0.3 + 0.05 * (n + 1);
    const double one_s = timed(*renderer, scene, shot.eyes, size);
    if (n >= 0) seconds.push_back(one_s);
  }
  Drawn drawn;
  if (!seconds.empty()) drawn.seconds = median(seconds);
  drawn.statistics = renderer->statistics();
  for (size_t eye = 0; eye < shot.eyes.size(); ++eye)
    for (const uint32_t colour : got(renderer->read_back(int(eye))).colours)
      for (int shift = 0; shift < 24; shift += 8)
        drawn.bytes.push_back(static_cast<unsigned char>(colour >> shift));
  return drawn;
}

std::pair<double, double> moving_and_still(const std::shared_ptr<vulkan::Context>& context,
                                           const std::shared_ptr<const MovingVolume>& volume,
                                           const Look& look, int runs) {
  const auto renderer = got(VolumeRenderer::make(context, {kViewSize, 2}));
  expect(renderer->set_volumes(std::vector{volume}));
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, look}};
  std::vector<double> moving, still;
  for (int run = -1; run < runs; ++run) {
    scene.volumes[0].pointer.phase = 0.3 + 0.01 * (run + 1);
    for (std::vector<double>* times : {&moving, &still}) {
      const double one_s = timed(*renderer, scene, both_view_eyes(), kViewSize);
      if (run >= 0) times->push_back(one_s);
    }
  }
  return {median(moving), median(still)};
}

}  // namespace palpate::studies
