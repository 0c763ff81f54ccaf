#pragma once

#include <array>

/// The look of all plots and pages, in one place.
namespace palpate::report {

/// Okabe and Ito's colours, the darkest and most different first; the yellow one is left out, since
/// it can hardly be seen on white.
inline constexpr std::array<const char*, 8> kSeriesColours = {
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#555555", "#882255"};

inline constexpr const char* kInk = "#222222";   ///< text and marks that are laid over others
inline constexpr const char* kSoft = "#666666";  ///< axes and their numbers
inline constexpr const char* kGrid = "#E8E8E8";  ///< lines behind the data
inline constexpr const char* kPaper = "#FFFFFF";
inline constexpr const char* kMissing = "#D9D9D9";  ///< cells that were not measured

/// What gnuplot and browsers take, the first that is there.
inline constexpr const char* kFonts = "Inter, system-ui, Segoe UI, Helvetica, Arial, sans-serif";
inline constexpr double kFontPx = 13.0;

/// Dark blue over green to yellow, even in lightness for everyone: points of matplotlib's viridis.
inline constexpr std::array<const char*, 9> kMapColours = {"#440154", "#472D7B", "#3B528B",
                                                           "#2C728E", "#21918C", "#28AE80",
                                                           "#5EC962", "#ADDC30", "#FDE725"};

}  // namespace palpate::report
