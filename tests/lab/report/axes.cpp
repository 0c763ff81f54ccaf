#include "tests/lab/report/axes.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tests/lab/report/gnuplot.h"
#include "tests/lab/report/style.h"

namespace palpate::report {
namespace {

std::string own_ticks(const char* axis, const Axis& of) {
  std::string ticks;
  for (const auto& [at, text] : of.ticks)
    ticks += fmt::format("{}\"{}\" {:.9g}", ticks.empty() ? "" : ", ", gnuplot_text(text), at);
  return fmt::format("set {}tics ({}) nomirror scale 0.4 textcolor rgb \"{}\"\n", axis, ticks,
                     kSoft);
}

/// Numbers at 1, 2 and 5 for a span of three decades or less, at the decades for a longer one.
std::string log_ticks(const char* axis, const Span& span) {
  const bool fine = std::log10(span.high / span.low) <= 3.0;
  std::string ticks;
  const int first = int(std::floor(std::log10(span.low)));
  const int last = int(std::ceil(std::log10(span.high)));
  // Of very many decades only every second or third one has a number.
  const int every = std::max(1, (last - first + 3) / 7);
  for (int decade = first; decade <= last; decade += every) {
    for (const int digit : {1, 2, 5}) {
      if (digit != 1 && !fine) continue;
      const double value = digit * std::pow(10.0, decade);
      if (value < span.low * 0.999 || value > span.high * 1.001) continue;
      ticks += fmt::format("{}\"{:g}\" {:.6g}", ticks.empty() ? "" : ", ", value, value);
    }
  }
  // A span without such a number still needs numbers at its ends.
  if (ticks.empty()) {
    ticks = fmt::format("\"{:.3g}\" {:.6g}, \"{:.3g}\" {:.6g}", span.low, span.low, span.high,
                        span.high);
  }
  return fmt::format("set {}tics ({}) nomirror scale 0.4 textcolor rgb \"{}\"\n", axis, ticks,
                     kSoft);
}

std::string axis_script(const char* name, const Axis& axis, const Span& span) {
  std::string script = fmt::format(
      "set {0}range [{1:.9g}:{2:.9g}] noextend\nset {0}label \"{3}\" textcolor rgb \"{4}\"\n", name,
      span.low, span.high, gnuplot_text(axis.title), kInk);
  if (span.logarithmic) script += fmt::format("set logscale {}\n", name);
  if (!axis.ticks.empty()) return script + own_ticks(name, axis);
  if (span.logarithmic) return script + log_ticks(name, span);
  return script + fmt::format("set {}tics nomirror scale 0.4 textcolor rgb \"{}\"\n", name, kSoft);
}

}  // namespace

bool Span::can_show(double value) const {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

double Span::place(double value) const {
  if (logarithmic) return std::log(value / low) / std::log(high / low);
  return (value - low) / (high - low);
}

Span span_of(const Axis& axis, const std::vector<double>& values, double room) {
  Span span{0.0, 0.0, axis.logarithmic};
  bool any = false;
  for (const double value : values) {
    if (!span.can_show(value)) continue;
    span.low = any ? std::min(span.low, value) : value;
    span.high = any ? std::max(span.high, value) : value;
    any = true;
  }
  if (!any) span.low = span.high = 1.0;
  if (span.logarithmic) {
    const double wide = std::max(span.high / span.low, 1.5);
    const double more = std::pow(wide, room) * (span.high > span.low ? 1.0 : 1.2);
    span.low /= more;
    span.high *= more;
  } else {
    const double wide =
        span.high > span.low ? span.high - span.low : std::max(std::abs(span.high), 1.0);
    // Zero is included if it is near: a chart of errors that starts at 0.11 exaggerates
    // differences.
    const bool from_zero = span.low >= 0.0 && span.low < 2.0 * wide;
    span.low = from_zero ? 0.0 : span.low - room * wide;
    span.high += room * wide;
  }
  if (axis.low && span.can_show(*axis.low)) span.low = *axis.low;
  if (axis.high && span.can_show(*axis.high)) span.high = *axis.high;
  if (!(span.high > span.low)) span.high = span.logarithmic ? 2.0 * span.low : span.low + 1.0;
  return span;
}

std::string axes_script(const Axis& x, const Axis& y, const Span& x_span, const Span& y_span,
                        const Frame& frame, int width_px, int height_px, bool grid) {
  std::string script = fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n"
      "set tmargin at screen {:.5f}\n",
      frame.left / width_px, frame.right / width_px, frame.bottom / height_px,
      frame.top / height_px);
  script += fmt::format("set border 3 lc rgb \"{}\" lw 1\n", kSoft);
  script += axis_script("x", x, x_span) + axis_script("y", y, y_span);
  if (grid) script += fmt::format("set grid xtics ytics back lt 1 lw 1 lc rgb \"{}\"\n", kGrid);
  return script;
}

double text_width_px(const std::string& text) {
  const auto letters = std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  });
  return 0.55 * kFontPx * double(letters);
}

}  // namespace palpate::report
