#include "tests/charts/picture_file.h"

#include <cairo.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace palpate::charts {

glm::ivec3 ReadPicture::rgb(int x, int y) const {
  const uint32_t pixel = pixels[size_t(y) * size_t(width) + size_t(x)];
  return {int(pixel >> 16 & 255), int(pixel >> 8 & 255), int(pixel & 255)};
}

bool ReadPicture::colored(int x, int y) const {
  const glm::ivec3 c = rgb(x, y);
  return std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z}) > 50;
}

ReadPicture read_png(const std::string& path) {
  ReadPicture picture;
  cairo_surface_t* surface = cairo_image_surface_create_from_png(path.c_str());
  if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS) {
    picture.width = cairo_image_surface_get_width(surface);
    picture.height = cairo_image_surface_get_height(surface);
    picture.pixels.resize(size_t(picture.width) * size_t(picture.height));
    const int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < picture.height; ++y) {
      std::memcpy(&picture.pixels[size_t(y) * size_t(picture.width)],
                  cairo_image_surface_get_data(surface) + size_t(y) * size_t(stride),
                  size_t(picture.width) * sizeof(uint32_t));
    }
  }
  cairo_surface_destroy(surface);
  return picture;
}

glm::dvec2 centre_of_new_colors(const ReadPicture& one, const ReadPicture& other, int* count) {
  glm::dvec2 sum(0.0);
  *count = 0;
  for (int y = 0; y < std::min(one.height, other.height); ++y) {
    for (int x = 0; x < std::min(one.width, other.width); ++x) {
      if (!one.colored(x, y) || one.rgb(x, y) == other.rgb(x, y)) continue;
      sum += glm::dvec2(x, y);
      ++*count;
    }
  }
  return *count ? sum / double(*count) : sum;
}

ScratchFile::ScratchFile(const std::string& name)
    : path_((std::filesystem::temp_directory_path() /
             ("palpate-charts-" + std::to_string(::getpid()) + "-" + name))
                .string()) {}

ScratchFile::~ScratchFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

Grid centred_grid(glm::ivec3 size, glm::dvec3 spacing_mm, glm::dmat3 direction) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = direction;
  grid.origin_mm = direction * (-0.5 * spacing_mm * glm::dvec3(size - 1));
  return grid;
}

Volume filled_volume(const Grid& grid, const std::function<float(glm::dvec3)>& value_at) {
  Volume volume{grid, {}};
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        volume.values.push_back(value_at(grid.lps_from_index({i, j, k})));
      }
    }
  }
  return volume;
}

Field filled_field(const Grid& grid, const std::function<glm::dvec3(glm::dvec3)>& u_at) {
  Field field{grid, {}};
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        field.u_mm.emplace_back(u_at(grid.lps_from_index({i, j, k})));
      }
    }
  }
  return field;
}

}  // namespace palpate::charts
