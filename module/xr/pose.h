#pragma once

#include "module/scene/pose.h"

namespace palpate::xr {
using palpate::Pose;
}
