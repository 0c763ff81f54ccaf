#pragma once

#include <memory>
#include <string>
#include <vector>

#include "integration/studies/motion_contender.h"

namespace palpate::app {

/// The other registration methods that are here: ITK's four Demons filters (the program
/// palpate_itk_peer beside palpate), OpenCV's optical flows, elastix and plastimatch (where they
/// are installed). quick: ITK with a quarter of the iterations, and neither elastix nor
/// plastimatch. `missing` gets a sentence for each that is left out.
std::vector<std::unique_ptr<studies::PairMethod>> motion_peers(bool quick,
                                                               std::vector<std::string>& missing);

}  // namespace palpate::app
