#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"

/// Calling gnuplot, and making its SVG fit for a page.
namespace palpate::report {

/// A text as gnuplot reads it between double quotes: what the terminal must not take as a command
/// is escaped.
std::string gnuplot_text(const std::string& text);

/// A text as XML reads it, in an element or an attribute.
std::string xml_text(const std::string& text);

/// Runs a script (without terminal and output, which are set here) and returns one <svg> element.
/// tips[n] takes the place of the hypertext "tip<n>". Errors: kBadInput with what to install, or
/// with gnuplot's first complaint.
Result<std::string> run_gnuplot(const std::string& script, int width_px, int height_px,
                                const std::string& id, const std::string& title,
                                const std::vector<std::string>& tips);

}  // namespace palpate::report
