#include "integration/web/web_page.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "compute/volume/sequence.h"
#include "integration/files/atomic_file.h"
#include "integration/files/raster/image_writer.h"
#include "integration/files/sentences.h"
#include "integration/web/embedded.h"

namespace palpate::web {
namespace {

using nlohmann::json;

std::string base64_of(std::string_view bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t n = 0; n < bytes.size(); n += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - n);
    uint32_t group = 0;
    for (size_t b = 0; b < 3; ++b)
      group = group << 8 | (b < count ? uint8_t(bytes[n + b]) : uint8_t{0});
    for (size_t c = 0; c < 4; ++c) text += c <= count ? kLetters[group >> (18 - 6 * c) & 63] : '=';
  }
  return text;
}

Result<std::string> packed(std::string_view bytes) {
  z_stream stream{};
  const Error full{ErrorKind::kOutOfMemory,
                   "There is not enough memory to pack a volume of the page: close other programs"};
  if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) return full;
  std::string out(deflateBound(&stream, uLong(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  const int end = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (end != Z_STREAM_END) return full;
  return out;
}

void put_float(std::string& header, size_t offset, float value) {
  std::memcpy(header.data() + offset, &value, sizeof(value));
}

/// The frames as a packed NIfTI file, with the scale that turns codes into values.
Result<std::string> nifti_of(const WebVolume& volume) {
  static_assert(std::endian::native == std::endian::little, "headers are written as they are");
  constexpr size_t kSlope = 112, kIntercept = 116;  // scl_slope and scl_inter of NIfTI-1
  files::ImageToWrite image;
  image.grid = volume.grid;
  image.grid.j_reversed_in_file = false;
  image.type = SampleType::kUint8;
  for (const auto& frame : volume.frames) image.frames.push_back(frame.data());
  std::string bytes = files::nifti_header_of(image);
  if (volume.role != VolumeRole::kLabels) {
    put_float(bytes, kSlope, float((volume.high - volume.low) / 255.0));
    put_float(bytes, kIntercept, float(volume.low));
  }
  for (const auto& frame : volume.frames)
    bytes.append(reinterpret_cast<const char*>(frame.data()), frame.size());
  return packed(bytes);
}

const char* word(VolumeRole role) {
  switch (role) {
    case VolumeRole::kFrames:
      return "frames";
    case VolumeRole::kOverlay:
      return "overlay";
    case VolumeRole::kLabels:
      return "labels";
  }
  return "";
}

/// NiiVue's table of colours of labels: parallel lists, with the background first.
json colors_of(const std::vector<WebLabel>& labels) {
  json table = {{"R", {0}}, {"G", {0}}, {"B", {0}}, {"A", {0}}, {"I", {0}}, {"labels", {"none"}}};
  for (const WebLabel& label : labels) {
    table["R"].push_back(label.color.r);
    table["G"].push_back(label.color.g);
    table["B"].push_back(label.color.b);
    table["A"].push_back(255);
    table["I"].push_back(label.value);
    table["labels"].push_back(label.name);
  }
  return table;
}

Result<json> json_of(const WebVolume& volume) {
  const auto nifti = nifti_of(volume);
  if (!nifti) return nifti.error();
  json result = {{"role", word(volume.role)},
                 {"name", word(volume.role)},
                 {"title", volume.title},
                 {"unit", volume.unit},
                 {"note", volume.note},
                 {"colormap", volume.colormap},
                 {"low", volume.low},
                 {"high", volume.high},
                 {"frame_count", volume.frames.size()},
                 {"nifti", base64_of(*nifti)}};
  if (volume.role == VolumeRole::kLabels) result["label_colors"] = colors_of(volume.labels);
  return result;
}

json json_of(const WebPlot& plot) {
  json curves = json::array();
  // What is not finite becomes null, which JSON has no number for.
  for (const WebCurve& curve : plot.curves)
    curves.push_back({{"name", curve.name}, {"x", curve.x}, {"y", curve.y}});
  return {{"title", plot.title},
          {"x_label", plot.x_label},
          {"from_zero", plot.from_zero},
          {"follows_frames", plot.follows_frames},
          {"curves", curves}};
}

/// JSON as the text of a script element: "</script>" or "<!--" in a string must not end it.
std::string script_text(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

std::string html_text(const std::string& plain) {
  std::string text;
  for (const char c : plain) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      default:
        text += c;
    }
  }
  return text;
}

}  // namespace

std::string set_frames(WebPage& page, size_t count, const std::vector<double>& times_s,
                       double cycle_s) {
  const bool known = !times_s.empty();
  const bool in_ms = known && times_s.back() - times_s.front() < 10.0;
  const std::vector<double> assumed = assumed_times(count);
  for (size_t k = 0; k < count; ++k) {
    const double t = known ? times_s[k] - times_s.front() : assumed[k];
    std::string label = fmt::format("frame {}", k);
    if (known) label += in_ms ? fmt::format(", {:.0f} ms", 1e3 * t) : fmt::format(", {:.2f} s", t);
    if (known && cycle_s > 0.0) label += fmt::format(", {:.0f} % of the cycle", 100 * t / cycle_s);
    page.frame_labels.push_back(label);
    page.play_times_s.push_back(t);
    page.frame_times.push_back(!known ? double(k) : in_ms ? 1e3 * t : t);
  }
  const std::vector<double>& t = page.play_times_s;
  page.period_s = cycle_s > 0.0 ? cycle_s : t.back() + (count > 1 ? t.back() - t[count - 2] : 1.0);
  return !known ? "frame" : in_ms ? "ms" : "s";
}

std::vector<uint8_t> codes_of(const std::vector<float>& values, double low, double high) {
  std::vector<uint8_t> codes(values.size());
  const double scale = 255.0 / (high - low);
  std::transform(values.begin(), values.end(), codes.begin(), [&](float value) {
    if (!std::isfinite(value)) return uint8_t{0};
    return uint8_t(std::lround(std::clamp((double(value) - low) * scale, 0.0, 255.0)));
  });
  return codes;
}

std::vector<Grid> page_grids(const Grid& grid, size_t frames, double most) {
  std::vector<Grid> steps;
  Grid now = grid;
  while (double(now.count()) * double(frames) > most) {
    const glm::bvec3 fine = glm::lessThan(now.spacing_mm, glm::dvec3(1.5 * now.finest_mm()));
    const glm::bvec3 long_enough = glm::greaterThanEqual(now.size, glm::ivec3(16));
    glm::ivec3 block(1);
    for (int a = 0; a < 3; ++a) block[a] = fine[a] && long_enough[a] ? 2 : 1;
    if (block == glm::ivec3(1)) break;
    Grid next = now;
    next.size = now.size / block;
    next.spacing_mm = now.spacing_mm * glm::dvec3(block);
    next.origin_mm = now.lps_from_index(0.5 * glm::dvec3(block - 1));
    steps.push_back(next);
    now = next;
  }
  return steps;
}

Volume reduced(Volume volume, const std::vector<Grid>& steps) {
  for (const Grid& step : steps) volume = resampled(volume, step);
  return volume;
}

Status check_can_write_page(const std::filesystem::path& path) {
  if (embedded(Embedded::kNiiVue).empty()) {
    return files::bad_output(path,
                             "can not be written: this palpate was built without NiiVue, which "
                             "draws the volumes of a page; build it with a connection to the npm "
                             "registry, or with PALPATE_NIIVUE=niivue.umd.js for CMake");
  }
  if (path.extension() != ".html")
    return files::bad_output(path, "is to be a page for browsers: name it .html");
  return files::check_can_write_file(path);
}

Status write_web_page(const WebPage& page, const std::filesystem::path& path) {
  if (const Status can = check_can_write_page(path); !can) return can;
  json data = {{"title", page.title},
               {"subtitle", page.subtitle},
               {"frame_labels", page.frame_labels},
               {"frame_times", page.frame_times},
               {"play_times_s", page.play_times_s},
               {"period_s", page.period_s},
               {"volumes", json::array()},
               {"plots", json::array()},
               {"facts", json::array()}};
  if (!page.verdict.empty()) data["verdict"] = {{"word", page.verdict}, {"reasons", page.reasons}};
  for (const WebVolume& volume : page.volumes) {
    auto made = json_of(volume);
    if (!made) return made.error();
    data["volumes"].push_back(std::move(*made));
  }
  for (const WebPlot& plot : page.plots) data["plots"].push_back(json_of(plot));
  for (const auto& [name, value] : page.facts) data["facts"].push_back({name, value});

  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>";
  html += html_text(page.title) + "</title>\n<style>\n";
  html += embedded(Embedded::kStyle);
  html += "</style>\n</head>\n<body>\n<main></main>\n";
  html += "<script type=\"application/json\" id=\"palpate-data\">" + script_text(data);
  html += "</script>\n<script type=\"text/plain\" id=\"licences\">";
  html += embedded(Embedded::kLicences);
  html += "</script>\n<script>";
  html += embedded(Embedded::kNiiVue);
  html += "</script>\n<script>\n";
  html += embedded(Embedded::kScript);
  html += "</script>\n</body>\n</html>\n";
  return files::write_text(path, html);
}

}  // namespace palpate::web
