#include "tests/lab/stability/all_maps.h"

#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/loop_maps.h"
#include "tests/lab/stability/motion_maps.h"

namespace palpate::stability {

std::vector<MapMaker> maps_of(const std::string& group,
                              const std::shared_ptr<vulkan::Context>& context) {
  const auto motion = [context](MotionMapMaker make) {
    return [=](const Making& making) { return make(context, making); };
  };
  const std::vector<MapMaker> all = {
      {"motion", "large motion", 80, motion(displacement_map)},
      {"motion", "contrast", 60, motion(contrast_map)},
      {"motion", "noise", 60, motion(noise_map)},
      {"motion", "flat regions", 60, motion(aperture_map)},
      {"motion", "folding", 60, motion(folding_map)},
      {"motion", "sliding", 15, motion(sliding_map)},
      {"motion", "missing frames", 60, motion(frames_map)},
      {"motion", "thick slices", 40, motion(anisotropy_map)},
      {"back-tracking", "stretching", 1, stretch_map},
      {"back-tracking", "pressing", 5, press_map},
      {"back-tracking", "smooth motion", 1, waves_map},
      {"back-tracking", "strokes", 8, stroke_map},
      {"back-tracking", "thin walls", 12, dart_map},
      {"loop", "stiff walls", 7, stiffness_map},
      {"loop", "damping", 3, damping_map},
      {"loop", "hands", 1, hands_map},
      {"loop", "jitter", 2, jitter_map},
      {"loop", "encoders", 2, encoder_map},
      {"loop", "dragged volumes", 2, swing_map},
      {"loop", "beating data", 9, beat_map},
  };
  std::vector<MapMaker> wanted;
  for (const MapMaker& maker : all)
    if (group.empty() || group == maker.group) wanted.push_back(maker);
  return wanted;
}

}  // namespace palpate::stability
