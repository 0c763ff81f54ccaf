#include "tests/lab/stability/back_track_maps.h"

namespace palpate::stability {
namespace {

const char* const kFades = "holds the point and fades the force with the cause 'field'";

StabilityMap new_map(const char* name, const char* title) {
  StabilityMap map;
  map.group = "back-tracking";
  map.name = name;
  map.title = title;
  return map;
}

StabilityMap search_map(const char* name, const char* title, const Making& making, Flow flow) {
  StabilityMap map = new_map(name, title);
  map.failed = "one of the points asked for is not found to a thousandth of a cell";
  map.x = even_axis("q", "", 0.0, 3.0, making.count(7, 16));
  map.y = even_axis("phase", "", 0.1, 1.0, making.count(4, 10));
  map.colour = "points not found";
  map.colour_unit = "%";
  map.highest = 100.0;
  map.borders = {border_along_x("q times phase = 1 (Banach)", log_evenly(0.95, 20.0, 81),
                                [](double q) { return 1.0 / q; })};
  map.sides = {{"the paper's fixed point", "", {}}, {"palpate", kFades, {}}};
  fill(map, making, [&](size_t side, double q, double phase) {
    return search_cell(flow, q, phase, side == 1 ? BackTracking::kNewton : BackTracking::kPicard,
                       cell_seed(making.seed, q, phase));
  });
  return map;
}

}  // namespace

StabilityMap stretch_map(const Making& making) {
  StabilityMap map =
      search_map("stretched", "Inverting a stretching motion", making, Flow::kStretch);
  map.made =
      "Material that is stretched q-fold in a step, u = q x, which never folds: 2,000 points "
      "are sought where a hand would ask for them.";
  return map;
}

StabilityMap press_map(const Making& making) {
  StabilityMap map = search_map("pressed", "Inverting a pressing motion", making, Flow::kPress);
  map.made =
      "Material that is pressed together, u = -q x: at q times phase = 1 it is a point, beyond "
      "it is inside out and there is nothing to find.";
  return map;
}

StabilityMap waves_map(const Making& making) {
  StabilityMap map = search_map("waves", "Inverting random smooth motion", making, Flow::kWaves);
  map.made = "A random smooth field in each cell whose steepest place has the bound q.";
  return map;
}

StabilityMap stroke_map(const Making& making) {
  StabilityMap map = new_map("stroked", "Stroking data whose motion is steep or folded");
  map.made =
      "A hand 2.5 to 12 mm inside a beating shell strokes it for 4 s, 600 N/m; in one step of four "
      "the material also runs along the surface, with a gradient q.";
  map.failed =
      "the force changes by more than 0.05 N in a millisecond beyond what the hand's own way "
      "makes";
  map.x = even_axis("q", "", 0.0, 3.0, making.count(5, 13));
  map.y = log_axis("speed of the hand", "mm/s", 5.0, 200.0, making.count(3, 9));
  map.colour = "largest change of force in a ms";
  map.colour_unit = "N";
  map.logarithmic = true;
  map.lowest = 1e-3;
  map.highest = 10.0;
  map.borders = {border_at_x("q = 1 (Banach; here also where it folds)", 1.0, map.y)};
  map.sides = {{"the paper's loop", "", {}}, {"palpate", kFades, {}}};
  fill(map, making, [&](size_t side, double q, double mm_per_s) {
    return stroke_cell(q, 1e-3 * mm_per_s, side == 1, cell_seed(making.seed, q, mm_per_s));
  });
  return map;
}

StabilityMap dart_map(const Making& making) {
  StabilityMap map = new_map("pop-through", "A fast hand at a fast, thin wall");
  map.made =
      "A hand darts about a beating shell that is one voxel (1 mm) thin; counted is how often the "
      "proxy goes through although the force is below the wall's strength.";
  map.failed = "the proxy goes through once";
  map.x = log_axis("speed of the hand", "m/s", 0.02, 3.0, making.count(5, 12));
  map.y = even_axis("speed of the wall", "m/s", 0.0, 0.6, making.count(3, 7));
  map.colour = "times through, per second of contact";
  map.colour_unit = "1/s";
  map.logarithmic = true;
  map.lowest = 0.1;
  map.highest = 1e3;
  map.borders = {border_along_x("hand and wall together go one voxel in a tick",
                                evenly(0.35, 1.05, 33), [](double hand) { return 1.0 - hand; })};
  map.sides = {{"the paper's loop", "", {}}, {"palpate", "holds the point", {}}};
  fill(map, making, [&](size_t side, double hand, double wall) {
    return dart_cell(hand, wall, side == 1, making.quick ? 5000 : 40'000,
                     cell_seed(making.seed, hand, wall));
  });
  return map;
}

}  // namespace palpate::stability
