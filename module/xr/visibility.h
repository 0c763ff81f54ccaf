#pragma once

#include "module/xr/frame_source.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// What the optics hide of a view; empty without XR_KHR_visibility_mask or where nothing is hidden.
Outcome<HiddenMesh> hidden_mesh(const Instance& instance, const Session& session, uint32_t view);

}  // namespace palpate::xr
