#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tests/lab/studies/motion_contender.h"
#include "tests/lab/studies/view_study.h"

namespace palpate::app {

/// One of ITK's Demons filters, by its name in palpate_itk_peer.
struct ItkFilter {
  const char* name;
  const char* method;
};
inline constexpr std::array<ItkFilter, 4> kItkFilters{{{"Demons", "demons"},
                                                       {"Symmetric forces Demons", "symmetric"},
                                                       {"Fast symmetric forces Demons", "fast"},
                                                       {"Diffeomorphic Demons", "diffeomorphic"}}};
/// Iterations from coarse to fine: the best ones for the filters, and fewer.
inline constexpr const char* kItkLong = "50,50,30,20";
inline constexpr const char* kItkFew = "20,20,15,5";

/// The filter in the program palpate_itk_peer beside palpate-lab, which must never be linked with
/// ITK's registration; null if the program is not there.
std::unique_ptr<studies::PairMethod> itk_peer(const ItkFilter& filter, const char* iterations);

/// Seconds of one iteration of ITK's plain Demons on size^3 voxels of one level, every voxel
/// computed, Gauss of one voxel, by the same program. Errors: it is not there, or it registers
/// nothing.
Result<double> itk_demons_iteration_s(int size);

/// The other registration methods that are installed: ITK's four Demons filters, OpenCV's optical
/// flows, elastix and plastimatch. quick: ITK with a quarter of the iterations, and neither elastix
/// nor plastimatch. `missing` gets a sentence for each that is left out.
std::vector<std::unique_ptr<studies::PairMethod>> motion_peers(bool quick,
                                                               std::vector<std::string>& missing);

/// VTK's GPU ray caster on the data of the view study (the program view_peer beside palpate, on an
/// X server without a screen), in the time that is left; nothing in a quick run or if it is not
/// there.
std::vector<studies::ViewMeasure> view_peer(const studies::StudyRun& run,
                                            std::vector<std::string>& missing);

}  // namespace palpate::app
