#include "integration/opencv/testing.h"

#include <limits>
#include <ostream>
#include <string>
#include <utility>

#include "compute/motion/quality.h"
#include "integration/opencv/cross_check.h"

namespace palpate::testing {
namespace {

using ::testing::MatchResultListener;

/// What all four have in common: a measurement that says whether it passes and explains itself, and
/// a name.
template <class Measure>
class FieldMeasure : public ::testing::MatcherInterface<const Field&> {
 public:
  FieldMeasure(std::string property, Measure measure)
      : property_(std::move(property)), measure_(std::move(measure)) {}

  bool MatchAndExplain(const Field& field, MatchResultListener* listener) const override {
    if (field.u_mm.size() != field.grid.count() || field.u_mm.empty()) {
      *listener << "which has " << field.u_mm.size() << " vectors for " << field.grid.count()
                << " samples";
      return false;
    }
    return measure_(field, *listener);
  }
  void DescribeTo(std::ostream* out) const override { *out << "is a field that " << property_; }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "is not a field that " << property_;
  }

 private:
  std::string property_;
  Measure measure_;
};

template <class Measure>
FieldMatcher field_matcher(std::string property, Measure measure) {
  return FieldMatcher(new FieldMeasure<Measure>(std::move(property), std::move(measure)));
}

std::string voxels_text(double voxels) {
  return ::testing::PrintToString(voxels) + " voxels";
}

bool within(const Result<Distances>& found, double mean_voxels, MatchResultListener& listener) {
  if (!found) {
    listener << "which can not be compared: " << found.error().message;
    return false;
  }
  const Spread& voxels = found->voxels;
  listener << "which is off by " << voxels.mean << " voxels on average (median " << voxels.median
           << ", 95th percentile " << voxels.p95 << ", at most " << voxels.max << ") at "
           << voxels.count << " samples";
  return voxels.mean <= mean_voxels && voxels.max < std::numeric_limits<double>::infinity();
}

}  // namespace

FieldMatcher AgreesWithOpticalFlow(Volume fixed, Volume moving, double voxels) {
  return field_matcher(
      "agrees with optical flow within a median of " + voxels_text(voxels),
      [fixed = std::move(fixed), moving = std::move(moving), voxels](
          const Field& field, MatchResultListener& listener) {
        opencv::CrossCheckOptions options;
        options.agree_voxels = voxels;
        options.agree_p95_voxels = 4.0 * voxels;
        const Result<opencv::CrossCheck> check = opencv::cross_check(fixed, moving, field, options);
        if (!check) {
          listener << "which can not be compared: " << check.error().message;
          return false;
        }
        listener << check->summary;
        for (const opencv::FlowComparison& c : check->comparisons) {
          listener << "\n  slices across axis " << c.normal_axis << ", " << opencv::name(c.method)
                   << ": median " << c.difference.voxels.median << ", 95th percentile "
                   << c.difference.voxels.p95 << " voxels at " << c.compared << " of " << c.pixels
                   << " pixels, where the motion is " << c.motion_voxels;
        }
        return check->agreement == opencv::Agreement::kAgree;
      });
}

FieldMatcher HasNoFolds() {
  return field_matcher("has no folds", [](const Field& field, MatchResultListener& listener) {
    const Folds found = folds(field);
    listener << "which folds at " << found.folded << " of " << found.voxels
             << " samples, smallest determinant " << found.min_det;
    return found.folded == 0 && found.not_finite == 0;
  });
}

FieldMatcher IsWithin(Field truth, double mean_voxels) {
  return field_matcher(
      "is within " + voxels_text(mean_voxels) + " of the truth on average",
      [truth = std::move(truth), mean_voxels](const Field& field, MatchResultListener& listener) {
        return within(endpoint_error(field, truth), mean_voxels, listener);
      });
}

FieldMatcher IsWithin(Field truth, Mask mask, double mean_voxels) {
  return field_matcher(
      "is within " + voxels_text(mean_voxels) + " of the truth on average inside a mask",
      [truth = std::move(truth), mask = std::move(mask), mean_voxels](
          const Field& field, MatchResultListener& listener) {
        return within(endpoint_error(field, truth, &mask), mean_voxels, listener);
      });
}

FieldMatcher IsUndoneBy(Field backward, double mean_voxels) {
  return field_matcher(
      "is undone by another one within " + voxels_text(mean_voxels) + " on average",
      [backward = std::move(backward), mean_voxels](const Field& field,
                                                    MatchResultListener& listener) {
        return within(inverse_consistency(field, backward, field.grid), mean_voxels, listener);
      });
}

}  // namespace palpate::testing
