#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "compute/volume/result.h"
#include "integration/charts/color.h"

struct _cairo;
struct _cairo_surface;

namespace palpate::charts {

/// How a text is aligned with its anchor point.
enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double size_px = 15;
  bool bold = false;
  Color color{0.13, 0.15, 0.19};
  Align align = Align::kLeft;
  /// longer text is set smaller, down to three quarters, then cut with an ellipsis
  double max_width_px = 1e9;
  bool halo = false;  ///< a soft dark edge, for text on pictures
};

/// Pixels of a picture inside the page, row by row from the top; 0xAARRGGBB, premultiplied alpha.
struct Bitmap {
  int width = 0;
  int height = 0;
  std::vector<uint32_t> pixels;
};

/// A page to draw on, in pixels from its top left corner. One thread at a time.
class Canvas {
 public:
  Canvas(int width_px, int height_px, Color paper);
  /// Transparent at first, to be laid over something else.
  Canvas(int width_px, int height_px);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// False if there was no memory for the page; drawing is then without effect and save() says so.
  bool good() const;

  void fill_box(glm::dvec2 corner, glm::dvec2 size, Color color, double alpha = 1.0,
                double radius_px = 0.0);
  void draw_box(glm::dvec2 corner, glm::dvec2 size, Color color, double alpha, double radius_px);
  void fill_polygon(const std::vector<glm::dvec2>& points, Color color, double alpha = 1.0);
  void draw_line(const std::vector<glm::dvec2>& points, Color color, double width_px,
                 double alpha = 1.0);
  void fill_dot(glm::dvec2 centre, double radius_px, Color color, double alpha = 1.0);

  /// The baseline of the text starts, is centred or ends at `at`, by its style.
  void draw_text(const std::string& text, glm::dvec2 at, const TextStyle& style);
  /// The same, read from bottom to top.
  void draw_text_upwards(const std::string& text, glm::dvec2 at, const TextStyle& style);
  double text_width(const std::string& text, const TextStyle& style);

  /// Puts a raster with rounded corners; it must have the size in pixels of the place where it
  /// goes.
  void draw_raster(const Bitmap& raster, glm::dvec2 corner, double radius_px);

  /// Nothing is drawn outside the box until pop_clip().
  void push_clip(glm::dvec2 corner, glm::dvec2 size, double radius_px);
  void pop_clip();

  /// What was drawn so far; empty if there was no memory for it.
  Bitmap raster() const;

  /// Writes the page as PNG: whole or not at all (temporary file beside it, then rename). Errors:
  /// kBadOutput, kOutOfMemory.
  Status save(const std::string& path) const;

 private:
  void start();
  void set_color(Color color, double alpha);
  void trace_box(glm::dvec2 corner, glm::dvec2 size, double radius_px);
  std::string fitted(const std::string& text, const TextStyle& style, double* size_px);

  _cairo_surface* surface_ = nullptr;
  _cairo* cairo_ = nullptr;
};

}  // namespace palpate::charts
