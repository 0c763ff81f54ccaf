#pragma once

#include "module/xr/picture_source.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// What the optics hide of a view; empty without XR_KHR_visibility_mask or where nothing is hidden.
Outcome<HiddenMesh> hidden_mesh(const Instance& instance, const OpenXrSession& session,
                                uint32_t view);

}  // namespace palpate::xr
