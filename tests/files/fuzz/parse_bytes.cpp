#include "tests/files/fuzz/parse_bytes.h"

#include <cmath>

#include "docs/examples/vtk_image.h"
#include "integration/files/dicom/dicom_elements.h"
#include "integration/files/frame_times.h"
#include "integration/files/landmarks.h"
#include "integration/files/raster/meta_header.h"
#include "integration/files/raster/nifti_header.h"
#include "integration/files/raster/nrrd_header.h"
#include "integration/files/sequence_motion_file.h"
#include "tests/support/require.h"

namespace palpate::files::fuzz {
namespace {

void check_sentence(const Error& error) {
  require(error.message.size() > 10, "an error is a sentence");
  require(error.message.find(": ") != std::string::npos, "an error says what to do");
}

void check_raster(const Result<Raster>& found) {
  if (!found) return check_sentence(found.error());
  const Grid& grid = found->grid;
  for (int axis = 0; axis < 3; ++axis) {
    require(grid.size[axis] >= 1, "sizes are positive");
    require(grid.spacing_mm[axis] > 0.0 && std::isfinite(grid.spacing_mm[axis]),
            "spacings are positive");
    require(std::isfinite(grid.origin_mm[axis]), "the origin is finite");
  }
  require(std::abs(glm::determinant(grid.direction) - 1.0) < 0.01, "the direction is a rotation");
  require(found->lanes >= 1 && double(found->lanes) <= kMaxLanes,
          "there are not absurdly many lanes");
  require(found->inner >= 1 && grid.count() % found->inner == 0, "lanes lie between whole axes");
  require(!found->data.empty(), "there is a file with the samples");
  require(std::isfinite(found->slope) && std::isfinite(found->intercept), "the scaling is finite");
  require(found->times_known == !found->times_s.empty(), "known times are there");
  if (found->times_known) {
    require(found->times_s.size() == found->frame_count() && is_rising(found->times_s),
            "times rise, one per frame");
  }
}

}  // namespace

void parse_nrrd(std::string_view bytes) {
  check_raster(parse_nrrd_header("folder/fuzz.nrrd", bytes));
}

void parse_sequence_motion(std::string_view bytes) {
  const auto found = parse_sequence_motion_header("folder/fuzz.nrrd", bytes);
  if (!found) return check_sentence(found.error());
  check_raster(found->raster);
  const TimeBasis& basis = found->basis;
  require(basis.times_s.size() >= 2 && is_rising(basis.times_s) && basis.times_s.front() == 0.0,
          "times rise from 0");
  require(found->reference < basis.times_s.size(), "the reference is a frame");
  require(basis.cycle_s == 0.0 || basis.cycle_s > basis.times_s.back(), "the cycle is whole");
  require(found->raster.lanes == 3 * basis.terms(), "all terms are there");
  for (const double time_s : {-1e300, 0.0, 0.3, 1e300}) {
    const TimeWeights weights = basis.at(time_s);
    for (int n = 0; n < weights.count; ++n)
      require(size_t(weights.term[size_t(n)]) < basis.summands() &&
                  std::isfinite(weights.weight[size_t(n)]),
              "any time can be asked for");
  }
}

void parse_meta(std::string_view bytes) {
  check_raster(parse_meta_header("folder/fuzz.mha", bytes));
}

void parse_nifti(std::string_view bytes) {
  const bool packed = !bytes.empty() && (bytes.back() & 1) != 0;
  check_raster(parse_nifti_header("folder/fuzz.nii", bytes, packed));
}

void parse_vtk(std::string_view bytes) {
  check_raster(parse_vtk_header("folder/fuzz.vtk", bytes));
}

static void check_elements(const DicomElements& found, std::string_view bytes) {
  for (const auto& [tag, value] : found.values) {
    require(value.empty() || (value.data() >= bytes.data() &&
                              value.data() + value.size() <= bytes.data() + bytes.size()),
            "values lie in the file");
    // Every accessor of a value must be safe for any bytes.
    found.text(tag);
    require(found.whole(tag).value_or(0) >= 0, "whole numbers are not negative");
    require(std::isfinite(found.number(tag).value_or(0.0)) &&
                std::isfinite(found.real(tag).value_or(0.0)),
            "numbers are finite");
    require(found.numbers(tag, 3).size() % 3 == 0 && found.reals(tag, 3).size() % 3 == 0,
            "there are as many numbers as asked for, or none");
  }
  for (const auto& [tag, items] : found.sequences)
    for (const DicomElements& item : items) check_elements(item, bytes);
}

void parse_dicom_file(std::string_view bytes) {
  const auto found = parse_dicom("folder/fuzz.dcm", bytes);
  if (!found) return check_sentence(found.error());
  const std::string_view parsed = found->inflated ? std::string_view(*found->inflated) : bytes;
  check_elements(*found, parsed);
  const std::string_view pixels = found->pixels;
  require(pixels.empty() || (pixels.data() >= parsed.data() &&
                             pixels.data() + pixels.size() <= parsed.data() + parsed.size()),
          "pixels lie in the file");
}

static void check_points(const Result<Landmarks>& found) {
  if (!found) return check_sentence(found.error());
  require(!found->points_lps_mm.empty(), "there is a point");
  for (const glm::dvec3& p : found->points_lps_mm) {
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "points are finite");
  }
}

void parse_points(std::string_view bytes) {
  const bool slicer = !bytes.empty() && (bytes.back() & 1) != 0;
  check_points(parse_landmarks(slicer ? "fuzz.fcsv" : "fuzz.csv", bytes));
}

void parse_followed(std::string_view bytes) {
  for (const int frame : {0, 1, -1}) check_points(parse_followed_points("fuzz.csv", bytes, frame));
}

}  // namespace palpate::files::fuzz
