#include "module/view/parameters.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

using namespace view_shaders;

namespace {

glm::dvec3 linear(glm::dvec3 srgb) {
  return {linear_from_srgb(srgb.x), linear_from_srgb(srgb.y), linear_from_srgb(srgb.z)};
}

/// A ray in double: precision is lost only when it is stored, in the space in which it is used.
struct Rays {
  glm::dvec3 origin, first, right, down;
};

Rays world_rays(const Eye& eye, PictureSize size) {
  const double right = (eye.tan_right - eye.tan_left) / size.width;
  const double down = (eye.tan_up - eye.tan_down) / size.height;
  const glm::dvec3 first(eye.tan_left + 0.5 * right, eye.tan_up - 0.5 * down, -1.0);
  return {eye.position_m, eye.orientation * first, eye.orientation * glm::dvec3(right, 0.0, 0.0),
          eye.orientation * glm::dvec3(0.0, -down, 0.0)};
}

ViewRays stored(const Rays& rays) {
  return {glm::vec4(rays.origin, 0.0), glm::vec4(rays.first, 0.0), glm::vec4(rays.right, 0.0),
          glm::vec4(rays.down, 0.0)};
}

}  // namespace

ViewRays rays_of(const Eye& eye, PictureSize size, glm::dvec3 origin_m, double unit_m) {
  const Rays world = world_rays(eye, size);
  return stored({(world.origin - origin_m) / unit_m, world.first / unit_m, world.right / unit_m,
                 world.down / unit_m});
}

ViewParameters parameters_of(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                             double near_m) {
  ViewParameters parameters{};
  // The first eye's picture has the whole gradient of the background; the others continue it.
  const double height = eyes.front().tan_up - eyes.front().tan_down;
  for (size_t e = 0; e < eyes.size(); ++e) {
    const double row = (eyes[e].tan_up - eyes[e].tan_down) / size.height;
    ViewRays& rays = parameters.rays[e] = rays_of(eyes[e], size);
    rays.first.w = float((eyes.front().tan_up - eyes[e].tan_up + 0.5 * row) / height);
    rays.down.w = float(row / height);
  }
  for (size_t p = 0; p < scene.clips.size(); ++p)
    parameters.planes[p] = glm::vec4(scene.clips[p].normal, scene.clips[p].offset_m);
  parameters.background = glm::vec4(linear(scene.background_top), near_m);
  parameters.background_low = glm::vec4(linear(scene.background_bottom), 0.0);
  parameters.light =
      glm::vec4(eyes.front().orientation * glm::normalize(scene.light), scene.samples_moved);
  parameters.counts =
      glm::ivec4(int(eyes.size()), int(scene.clips.size()), size.width, size.height);
  return parameters;
}

ViewVolumeParameters volume_parameters_of(const ViewScene& scene, const ViewVolume& volume,
                                          std::span<const Eye> eyes, PictureSize size,
                                          const ResidentFrames& frames, double samples_per_voxel) {
  const Transform& transform = volume.world_from_volume;
  const glm::dmat3 index_from_volume = frames.place.index_from_volume;
  const glm::dmat3 turn = glm::transpose(glm::mat3_cast(transform.rotation));
  const auto index_way = [&](glm::dvec3 way) {
    return index_from_volume * ((turn * way) / transform.scale);
  };
  ViewVolumeParameters p{};
  for (size_t e = 0; e < eyes.size(); ++e) {
    const Rays world = world_rays(eyes[e], size);
    p.rays[e] =
        stored({index_from_volume * transform.volume_from_world(world.origin) + frames.place.offset,
                index_way(world.first), index_way(world.right), index_way(world.down)});
  }
  p.size = glm::vec4(glm::vec3(frames.place.size), 1.0F);
  const double finest = std::min({frames.spacing_mm.x, frames.spacing_mm.y, frames.spacing_mm.z});
  p.spacing_mm = glm::vec4(frames.spacing_mm, samples_per_voxel / finest);
  const Look& look = volume.look;
  const double range = frames.highest - frames.lowest;
  const double slope =
      (look.surface_slope > 0.0 ? look.surface_slope : 0.1 * std::max(width_of(look), 1e-9)) /
      range;
  p.table = glm::vec4(kTable - 1, 0.5F, 0.0F, 1.0 / (slope * slope));
  p.shine =
      glm::vec4(look.shine.ambient, look.shine.diffuse, look.shine.specular, look.flat_opacity);
  // Along the voxels' axes, which are at right angles: a direction only has to be turned.
  const auto voxel_axes = [&](glm::dvec3 way) {
    return glm::normalize(frames.spacing_mm * (index_from_volume * (turn * way)));
  };
  const glm::dvec3 light = eyes.front().orientation * glm::normalize(scene.light);
  p.light = glm::vec4(voxel_axes(light), 0.0);
  glm::dmat3 axes = index_from_volume;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) axes[c][r] = std::abs(axes[c][r] * frames.spacing_mm[r] * 1e-3);
  const double least = std::min({transform.scale.x, transform.scale.y, transform.scale.z});
  p.stretch = glm::vec4(axes * (least / transform.scale), frames.curved ? 0.5 : 0.0);
  return p;
}

SeenVoxels seen_voxels(const ViewVolume& volume, const Eye& eye, PictureSize size,
                       const ResidentFrames& frames) {
  const Transform& transform = volume.world_from_volume;
  const glm::dmat3 volume_from_index = glm::inverse(frames.place.index_from_volume);
  SeenVoxels seen;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 share(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 index = share * glm::dvec3(frames.place.size) - 0.5;
    const glm::dvec3 world =
        transform.world_from_volume(volume_from_index * (index - frames.place.offset));
    const glm::dvec3 from_eye = glm::conjugate(eye.orientation) * (world - eye.position_m);
    seen.farthest_m = std::max(seen.farthest_m, -from_eye.z);
  }
  const glm::dvec3 &spacing = frames.spacing_mm, &scale = transform.scale;
  const double voxel_m =
      1e-3 * std::min({spacing.x, spacing.y, spacing.z}) * std::min({scale.x, scale.y, scale.z});
  const double pixel = std::max((eye.tan_right - eye.tan_left) / size.width,
                                (eye.tan_up - eye.tan_down) / size.height);
  seen.least_pixels = voxel_m / std::max(pixel * seen.farthest_m, 1e-12);
  return seen;
}

void fill_table(const Look& look, double lowest, double highest, std::span<glm::vec4> table,
                std::span<uint32_t> next, std::span<float> most) {
  uint32_t following = kTable;
  for (int e = kTable - 1; e >= 0; --e) {
    const double value = lowest + (highest - lowest) * e / (kTable - 1);
    const LookSample sample = look_at(look, value);
    table[size_t(e)] = glm::vec4(sample.colour, sample.extinction_per_mm);
    if (table[size_t(e)].w > 0.0F) following = uint32_t(e);
    next[size_t(e)] = following;
    most[size_t(e)] = table[size_t(e)].w;
  }
  // Integrals over the entries, in double: they are used as differences.
  glm::dvec4 sum(0.0);
  for (size_t e = 0; e < size_t(kTable); ++e) {
    const glm::dvec4 here(table[e]);
    const glm::dvec4 before(table[e > 0 ? e - 1 : 0]);
    const glm::dvec4 glow(glm::dvec3(here) * here.w, here.w);
    const glm::dvec4 glow_before(glm::dvec3(before) * before.w, before.w);
    if (e > 0) sum += 0.5 * (glow + glow_before);
    table[kTable + e] = glm::vec4(sum);
  }
  for (size_t level = 1; level < size_t(kMostLevels); ++level) {
    const std::span<float> half = most.subspan((level - 1) * kTable, kTable);
    for (size_t e = 0; e < size_t(kTable); ++e) {
      const size_t other = std::min(e + (size_t(1) << (level - 1)), size_t(kTable) - 1);
      most[level * kTable + e] = std::max(half[e], half[other]);
    }
  }
}

}  // namespace palpate::view
