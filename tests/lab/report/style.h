#pragma once

#include <array>

/// The style of all plots and pages, in one place.
namespace palpate::report {

/// Okabe and Ito's colours, the darkest and most different first; without yellow, which is hardly
/// visible on white.
inline constexpr std::array<const char*, 8> kSeriesColours = {
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#555555", "#882255"};

/// Text, and marks on top of others.
inline constexpr const char* kInk = "#222222";
inline constexpr const char* kSoft = "#666666";  ///< axes and their numbers
inline constexpr const char* kGrid = "#E8E8E8";  ///< lines behind the data
inline constexpr const char* kPaper = "#FFFFFF";
inline constexpr const char* kMissing = "#D9D9D9";  ///< cells that were not measured

/// Fonts for gnuplot and browsers; the first available one is used.
inline constexpr const char* kFonts = "Inter, system-ui, Segoe UI, Helvetica, Arial, sans-serif";
inline constexpr double kFontPx = 13.0;

/// Dark blue over green to yellow, of even lightness for any colour vision: points of matplotlib's
/// viridis.
inline constexpr std::array<const char*, 9> kMapColours = {"#440154", "#472D7B", "#3B528B",
                                                           "#2C728E", "#21918C", "#28AE80",
                                                           "#5EC962", "#ADDC30", "#FDE725"};

}  // namespace palpate::report
