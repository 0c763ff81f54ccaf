#pragma once

#include <openxr/openxr.h>

/// What the headers of Debian 12 (OpenXR 1.0.20) do not declare, with the numbers of Khronos'
/// registry (xr.xml); not for other folders.
namespace palpate::xr {

// XR_EXT_local_floor, extension 427
inline constexpr const char* kLocalFloorExtension = "XR_EXT_local_floor";
inline constexpr XrReferenceSpaceType kLocalFloorSpace = XrReferenceSpaceType(1000426000);

// XR_EXT_hand_interaction, extension 303: paths only
inline constexpr const char* kHandInteractionExtension = "XR_EXT_hand_interaction";
inline constexpr const char* kHandInteractionProfile =
    "/interaction_profiles/ext/hand_interaction_ext";

}  // namespace palpate::xr
