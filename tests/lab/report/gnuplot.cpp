#include "tests/lab/report/gnuplot.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>

#include <fmt/format.h>

#include "tests/lab/report/child.h"
#include "tests/lab/report/style.h"

namespace palpate::report {
namespace {

namespace fs = std::filesystem;

/// Changes gnuplot's SVG for a page: no header, a meaningful title, tool tips without scripts, and
/// ids that no other figure of the page has.
std::string fit_for_page(std::string svg, const std::string& id, const std::string& title,
                         const std::vector<std::string>& tips) {
  svg.erase(0, svg.find("<svg"));
  svg = std::regex_replace(svg, std::regex("<title>[A-Za-z0-9]*_plot_[0-9]+[a-z]*</title>"), "");
  svg = std::regex_replace(svg, std::regex("<desc>[^<]*</desc>"), "");
  svg = std::regex_replace(svg, std::regex("<title>Gnuplot</title>|<title>" + id + "</title>"),
                           "<title>" + xml_text(title) + "</title>");
  svg = std::regex_replace(svg, std::regex("font-family=\"Inter\""),
                           fmt::format("font-family=\"{}\"", kFonts));
  svg.replace(0, 4, "<svg role=\"img\"");
  static const std::regex ids("(id=['\"]|href=['\"]#|url\\(#)");
  svg = std::regex_replace(svg, ids, "$1" + id + "-");
  static const std::regex tip(
      "<g onmousemove=\"gnuplot_svg.showHypertext\\(evt,'tip([0-9]+)'\\)\" "
      "onmouseout=\"gnuplot_svg.hideHypertext\\(\\)\"><title> </title>");
  std::string result;
  auto end = svg.cbegin();
  for (std::sregex_iterator found(svg.cbegin(), svg.cend(), tip), last; found != last; ++found) {
    result.append(end, (*found)[0].first);
    const size_t n = std::stoul((*found)[1].str());
    result += "<g><title>" + (n < tips.size() ? xml_text(tips[n]) : "") + "</title>";
    end = (*found)[0].second;
  }
  return result.append(end, svg.cend());
}

Error trouble(const std::string& what) {
  return {ErrorKind::kBadInput, what};
}

}  // namespace

std::string gnuplot_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      result += ' ';
      continue;
    }
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string xml_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '"') {
      result += "&quot;";
    } else if (static_cast<unsigned char>(c) >= 0x20U || c == '\n' || c == '\t') {
      // Other control characters are not allowed in XML.
      result += c;
    }
  }
  return result;
}

Result<std::string> run_gnuplot(const std::string& script, int width_px, int height_px,
                                const std::string& id, const std::string& title,
                                const std::vector<std::string>& tips) {
  const ScratchFolder folder;
  if (folder.path().empty())
    return trouble("No temporary folder can be made for a plot: is the disk full?");
  const fs::path file = folder.path() / "plot.gp", svg = folder.path() / "plot.svg",
                 complaints = folder.path() / "complaints";
  std::ofstream out(file);
  out << fmt::format(
      "set encoding utf8\nset terminal svg size {},{} font \"Inter,{}\" noenhanced name \"{}\" "
      "background \"{}\"\nset output \"{}\"\n",
      width_px, height_px, kFontPx, id, kPaper, gnuplot_text(svg.string()));
  out << script << "unset output\n";
  out.close();
  if (!out) return trouble("A plot's script could not be written: is the disk full?");
  const int failed = call_program({"gnuplot", file.string()}, folder.path() / "out", complaints);
  if (failed == ENOENT) {
    return trouble(
        "gnuplot, which draws the plots, is not installed: apt-get install gnuplot-nox, then try "
        "again.");
  }
  if (failed > 0)
    return trouble(fmt::format("gnuplot could not be started: {}.", std::strerror(failed)));
  std::string drawing = text_of(svg);
  if (failed != 0 || drawing.find("</svg>") == std::string::npos)
    return trouble(fmt::format("gnuplot could not draw '{}': {}", title, text_of(complaints)));
  return fit_for_page(std::move(drawing), id, title, tips);
}

}  // namespace palpate::report
