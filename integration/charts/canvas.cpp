#include "integration/charts/canvas.h"

#include <cairo.h>
#include <fmt/core.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

#include "compute/volume/open_file.h"
#include "integration/files/descriptor.h"

namespace palpate::charts {
namespace {

constexpr double kPi = std::numbers::pi;

// Inter where it is installed; where it is not, fontconfig uses the system's sans serif.
constexpr const char* kFontFamily = "Inter";

cairo_status_t append_to_file(void* file, const unsigned char* data, unsigned length) {
  return std::fwrite(data, 1, length, static_cast<FILE*>(file)) == length
             ? CAIRO_STATUS_SUCCESS
             : CAIRO_STATUS_WRITE_ERROR;
}

Error write_failed(const std::string& path, int code) {
  return {ErrorKind::kBadOutput,
          fmt::format("The picture {} could not be written ({}): choose a folder that exists, has "
                      "room and may be written to.",
                      path, std::strerror(code))};
}

// Cuts the last whole UTF-8 character.
void drop_last_character(std::string* text) {
  while (!text->empty() && (static_cast<unsigned char>(text->back()) & 0xC0) == 0x80) {
    text->pop_back();
  }
  if (!text->empty()) text->pop_back();
}

}  // namespace

Canvas::Canvas(int width_px, int height_px, Color paper) {
  surface_ = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px);
  start();
  set_color(paper, 1.0);
  cairo_paint(cairo_);
}

Canvas::Canvas(int width_px, int height_px) {
  surface_ = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width_px, height_px);
  start();
}

void Canvas::start() {
  cairo_ = cairo_create(surface_);
  cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
  cairo_set_font_options(cairo_, options);
  cairo_font_options_destroy(options);
}

Canvas::~Canvas() {
  cairo_destroy(cairo_);
  cairo_surface_destroy(surface_);
}

bool Canvas::good() const {
  return cairo_status(cairo_) == CAIRO_STATUS_SUCCESS;
}

void Canvas::set_color(Color color, double alpha) {
  cairo_set_source_rgba(cairo_, color.r, color.g, color.b, alpha);
}

void Canvas::trace_box(glm::dvec2 corner, glm::dvec2 size, double radius_px) {
  const double radius = std::min(radius_px, 0.5 * std::min(size.x, size.y));
  cairo_new_sub_path(cairo_);
  cairo_arc(cairo_, corner.x + size.x - radius, corner.y + radius, radius, -0.5 * kPi, 0.0);
  cairo_arc(cairo_, corner.x + size.x - radius, corner.y + size.y - radius, radius, 0, 0.5 * kPi);
  cairo_arc(cairo_, corner.x + radius, corner.y + size.y - radius, radius, 0.5 * kPi, kPi);
  cairo_arc(cairo_, corner.x + radius, corner.y + radius, radius, kPi, 1.5 * kPi);
  cairo_close_path(cairo_);
}

void Canvas::fill_box(glm::dvec2 corner, glm::dvec2 size, Color color, double alpha,
                      double radius_px) {
  trace_box(corner, size, radius_px);
  set_color(color, alpha);
  cairo_fill(cairo_);
}

void Canvas::draw_box(glm::dvec2 corner, glm::dvec2 size, Color color, double alpha,
                      double radius_px) {
  trace_box(corner, size, radius_px);
  set_color(color, alpha);
  cairo_set_line_width(cairo_, 1.0);
  cairo_stroke(cairo_);
}

void Canvas::fill_polygon(const std::vector<glm::dvec2>& points, Color color, double alpha) {
  if (points.empty()) return;
  cairo_new_path(cairo_);
  for (const glm::dvec2& p : points) cairo_line_to(cairo_, p.x, p.y);
  cairo_close_path(cairo_);
  set_color(color, alpha);
  cairo_fill(cairo_);
}

void Canvas::draw_line(const std::vector<glm::dvec2>& points, Color color, double width_px,
                       double alpha) {
  if (points.empty()) return;
  cairo_new_path(cairo_);
  for (const glm::dvec2& p : points) cairo_line_to(cairo_, p.x, p.y);
  set_color(color, alpha);
  cairo_set_line_width(cairo_, width_px);
  cairo_stroke(cairo_);
}

void Canvas::fill_dot(glm::dvec2 centre, double radius_px, Color color, double alpha) {
  cairo_new_path(cairo_);
  cairo_arc(cairo_, centre.x, centre.y, radius_px, 0.0, 2.0 * kPi);
  set_color(color, alpha);
  cairo_fill(cairo_);
}

double Canvas::text_width(const std::string& text, const TextStyle& style) {
  cairo_select_font_face(cairo_, kFontFamily, CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_, style.size_px);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_, text.c_str(), &extents);
  return extents.x_advance;
}

std::string Canvas::fitted(const std::string& text, const TextStyle& style, double* size_px) {
  TextStyle trial = style;
  const double wide = text_width(text, trial);
  if (wide <= style.max_width_px) {
    *size_px = style.size_px;
    return text;
  }
  trial.size_px = std::max(0.75 * style.size_px, style.size_px * style.max_width_px / wide);
  *size_px = trial.size_px;
  std::string cut = text;
  std::string shown = text;
  while (!cut.empty() && text_width(shown, trial) > style.max_width_px * 1.001) {
    drop_last_character(&cut);
    shown = cut + "\u2026";
  }
  return shown;
}

void Canvas::draw_text(const std::string& text, glm::dvec2 at, const TextStyle& style) {
  TextStyle set = style;
  const std::string shown = fitted(text, style, &set.size_px);
  const double width = text_width(shown, set);
  if (style.align == Align::kCentre) at.x -= 0.5 * width;
  if (style.align == Align::kRight) at.x -= width;
  if (style.halo) {
    cairo_move_to(cairo_, at.x, at.y);
    cairo_text_path(cairo_, shown.c_str());
    set_color({0, 0, 0}, 0.55);
    cairo_set_line_width(cairo_, 0.22 * set.size_px);
    cairo_stroke(cairo_);
  }
  cairo_move_to(cairo_, at.x, at.y);
  set_color(style.color, 1.0);
  cairo_show_text(cairo_, shown.c_str());
}

void Canvas::draw_text_upwards(const std::string& text, glm::dvec2 at, const TextStyle& style) {
  cairo_save(cairo_);
  cairo_translate(cairo_, at.x, at.y);
  cairo_rotate(cairo_, -0.5 * kPi);
  draw_text(text, {0.0, 0.0}, style);
  cairo_restore(cairo_);
}

void Canvas::draw_raster(const Bitmap& raster, glm::dvec2 corner, double radius_px) {
  cairo_surface_t* image =
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, raster.width, raster.height);
  if (cairo_surface_status(image) == CAIRO_STATUS_SUCCESS) {
    cairo_surface_flush(image);
    const int stride = cairo_image_surface_get_stride(image);
    for (int row = 0; row < raster.height; ++row) {
      std::memcpy(cairo_image_surface_get_data(image) + size_t(row) * size_t(stride),
                  raster.pixels.data() + size_t(row) * size_t(raster.width),
                  size_t(raster.width) * sizeof(uint32_t));
    }
    cairo_surface_mark_dirty(image);
    push_clip(corner, {raster.width, raster.height}, radius_px);
    cairo_set_source_surface(cairo_, image, corner.x, corner.y);
    cairo_paint(cairo_);
    pop_clip();
  }
  cairo_surface_destroy(image);
}

void Canvas::push_clip(glm::dvec2 corner, glm::dvec2 size, double radius_px) {
  cairo_save(cairo_);
  trace_box(corner, size, radius_px);
  cairo_clip(cairo_);
}

void Canvas::pop_clip() {
  cairo_restore(cairo_);
}

Bitmap Canvas::raster() const {
  Bitmap raster;
  if (!good()) return raster;
  cairo_surface_flush(surface_);
  raster.width = cairo_image_surface_get_width(surface_);
  raster.height = cairo_image_surface_get_height(surface_);
  raster.pixels.resize(size_t(raster.width) * size_t(raster.height));
  const size_t stride = size_t(cairo_image_surface_get_stride(surface_));
  for (size_t row = 0; row < size_t(raster.height); ++row)
    std::memcpy(raster.pixels.data() + row * size_t(raster.width),
                cairo_image_surface_get_data(surface_) + row * stride,
                size_t(raster.width) * sizeof(uint32_t));
  return raster;
}

Status Canvas::save(const std::string& path) const {
  if (!good()) {
    return Error{ErrorKind::kOutOfMemory,
                 fmt::format("There is no memory to draw the picture {}: close other programs and "
                             "try again.",
                             path)};
  }
  const std::filesystem::path partial = fmt::format("{}.partial-{}", path, files::process_id());
  std::FILE* file = open_file(partial, "wb");
  if (!file) return write_failed(path, errno);
  const cairo_status_t drawn = cairo_surface_write_to_png_stream(surface_, append_to_file, file);
  const int write_error = errno;
  const bool closed = std::fclose(file) == 0;
  if (drawn == CAIRO_STATUS_SUCCESS && closed) {
    if (files::rename_over(partial, path)) return Nothing{};
  }
  const int code = drawn == CAIRO_STATUS_SUCCESS ? errno : write_error;
  files::remove_quietly(partial);
  return write_failed(path, code);
}

}  // namespace palpate::charts
