#include "integration/report/gnuplot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include <fmt/format.h>

#include "integration/report/style.h"

extern char** environ;

namespace palpate::report {
namespace {

namespace fs = std::filesystem;

/// A folder that goes when it goes out of scope.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string pattern = (fs::temp_directory_path(error) / "palpate-plot-XXXXXX").string();
    if (!error && ::mkdtemp(pattern.data())) path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

/// Starts gnuplot on a script and waits; what it complains of goes to a file. The error number of
/// starting it, or -1 where it started and failed, or 0.
int call_gnuplot(const fs::path& script, const fs::path& complaints) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, complaints.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  // The program may have blocked signals for itself; gnuplot must die of them as ever.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  std::string name = "gnuplot", file = script.string();
  char* arguments[] = {name.data(), file.data(), nullptr};
  pid_t child = 0;
  const int started = posix_spawnp(&child, "gnuplot", &files, &attributes, arguments, environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (started != 0) return started;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : -1;
}

/// What gnuplot wrote, for a page: no header, a title that says something, tool tips without
/// scripts, and ids that no other figure of the page has.
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
      result += c;  // Other control characters have no place in XML at all.
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
  const int failed = call_gnuplot(file, complaints);
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
