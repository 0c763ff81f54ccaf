#pragma once

// What single pictures and whole pages share; not for outside this folder.

#include <string>
#include <vector>

#include "compute/motion/quality.h"
#include "integration/charts/charts.h"
#include "integration/charts/overlays.h"
#include "integration/charts/page.h"

namespace palpate::charts {

/// Nothing, or why a picture can not be drawn from these values.
Status checked(const std::string& path, const Grid& grid, size_t samples, const char* what);

/// A page of `contents.size()` rows by the views of the box, headings and footnote included.
Page views_page(const Caption& caption, const BoundingBox& box, glm::dvec3 focus_lps_mm,
                const std::vector<const Content*>& rows);

/// The page with one content per column and one view per row.
Page table_page(const Caption& caption, const BoundingBox& box, glm::dvec3 focus_lps_mm,
                const std::vector<const Content*>& columns);

/// "mean 3.9, p95 12, max 15 mm"
std::string length_numbers(const Spread& lengths_mm);

/// Of u inside the mask (null, or on any grid): what the command says in words.
std::string motion_numbers(const Field& field, const Mask* mask);

/// Of |u - truth| at the truth's samples inside the mask.
std::string error_numbers(const Field& field, const Field& truth, const Mask* mask);

/// A window in which the brightest tissue stays grey, so that what is drawn over it stands out.
Range dimmed(Range window);

/// "Arrows are drawn 5 x their length."; empty if they are true.
std::string stretch_note(double stretch);

/// "Patient's left is on the right of ..."
std::string hanging_note();

/// Values of differences or lengths at points spread over the grid, inside the mask.
std::vector<double> spread_values(const Grid& grid, const Mask* mask,
                                  const std::function<double(glm::dvec3)>& value_at);

/// Signed, symmetric about zero, from the 99 % quantile of the sizes.
Range symmetric_range(const std::vector<double>& values);

/// Root of the mean square; 0 of none.
double root_mean_square(const std::vector<double>& values);

/// Where most moves: the mean position (LPS mm) of the field's samples, weighed by |u|^2, inside
/// the mask if there is one; the middle of the grid if nothing moves.
glm::dvec3 focus_of(const Field& field, const Mask* mask = nullptr);

}  // namespace palpate::charts
