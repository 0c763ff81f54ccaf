#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"

/// Calls gnuplot, and changes its SVG for a page.
namespace palpate::report {

/// A text as gnuplot reads it between double quotes: characters that the terminal would take as
/// commands are escaped.
std::string gnuplot_text(const std::string& text);

/// A text as XML reads it, in an element or an attribute.
std::string xml_text(const std::string& text);

/// Runs a script (without terminal and output, which are set here) and returns one <svg> element.
/// tips[n] replaces the hypertext "tip<n>". Errors: kBadInput with what to install, or with
/// gnuplot's first error message.
Result<std::string> run_gnuplot(const std::string& script, int width_px, int height_px,
                                const std::string& id, const std::string& title,
                                const std::vector<std::string>& tips);

}  // namespace palpate::report
