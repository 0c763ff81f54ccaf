#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/lab/studies/motion_contender.h"
#include "tests/lab/studies/view_study.h"

namespace palpate::app {

/// The other registration methods that are here: ITK's four Demons filters (the program
/// palpate_itk_peer beside palpate), OpenCV's optical flows, elastix and plastimatch (where they
/// are installed). quick: ITK with a quarter of the iterations, and neither elastix nor
/// plastimatch. `missing` gets a sentence for each that is left out.
std::vector<std::unique_ptr<studies::PairMethod>> motion_peers(bool quick,
                                                               std::vector<std::string>& missing);

/// VTK's GPU ray caster on the data of the view study (the program view_peer beside palpate, in an
/// X server without a screen), in the time that is left; nothing in a quick run or where it is not
/// there.
std::vector<studies::ViewMeasure> view_peer(const studies::StudyRun& run,
                                            std::vector<std::string>& missing);

}  // namespace palpate::app
