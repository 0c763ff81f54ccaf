#include "tests/lab/bench/anatomies.h"

#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "integration/files/read_volume.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/stability/made_pairs.h"
#include "tests/lab/studies/motion_case.h"

namespace palpate::bench {
namespace {

namespace fs = std::filesystem;

KnownCase read_kit(const fs::path& folder) {
  KnownCase pair{value_or_throw(files::read_volume(folder / "fixed.mha")),
                 value_or_throw(files::read_volume(folder / "moving.mha")),
                 value_or_throw(files::read_field(folder / "truth.mha")),
                 value_or_throw(files::read_mask(folder / "mask.mha")),
                 {}};
  if (fs::exists(folder / "mask_border.mha"))
    pair.border =
        nearest(value_or_throw(files::read_mask(folder / "mask_border.mha")), pair.truth.grid);
  // The truth may be sampled more coarsely than the frames and their masks.
  pair.mask = nearest(pair.mask, pair.truth.grid);
  return pair;
}

KnownCase read_lung_pair(const fs::path& lung) {
  return {value_or_throw(files::read_volume(lung / "pair_fixed.mha")),
          value_or_throw(files::read_volume(lung / "pair_moving.mha")),
          value_or_throw(files::read_field(lung / "pair_truth.mha")),
          value_or_throw(files::read_mask(lung / "pair_body.mha")),
          {}};
}

KnownCase shell(int size) {
  Sequence heart = shell_phantom(size);
  const Grid grid = heart.frames[0].grid;
  return {std::move(heart.frames[0]),
          std::move(heart.frames[1]),
          shell_truth(grid, 0, 1),
          shell_mask(grid, 0),
          {}};
}

/// Scored in the organ; the border is on the wall's side.
KnownCase sliding() {
  SlidingPhantom slide = sliding_phantom();
  return {std::move(slide.fixed), std::move(slide.moving), std::move(slide.truth),
          std::move(slide.organ), std::move(slide.wall)};
}

KnownCase known(stability::MotionPair made) {
  return {std::move(made.fixed),
          std::move(made.moving),
          std::move(made.truth),
          std::move(made.mask),
          {}};
}

}  // namespace

std::vector<CaseSource> known_cases(const fs::path& data) {
  std::vector<CaseSource> all;
  const auto kit = [&](const char* anatomy, const char* motion) {
    const std::string name = std::string(anatomy) + "_" + motion;
    const fs::path folder = data / "kit" / name;
    if (fs::exists(folder)) all.push_back({anatomy, name, [folder] { return read_kit(folder); }});
  };
  kit("bodypet", "affine");
  kit("bodypet", "breathing");
  kit("chestct", "breathing");
  kit("chestct", "sliding");
  kit("headmr", "sliding");
  kit("headmr", "waves");
  kit("spineus", "breathing");
  kit("spineus", "bspline");
  kit("thoraxmr", "bspline");
  kit("thoraxmr", "heart");
  kit("tooth", "affine");
  kit("tooth", "bspline");
  if (const fs::path lung = data / "lung"; fs::exists(lung))
    all.push_back({"lung", "lung_pair", [lung] { return read_lung_pair(lung); }});
  all.push_back({"shell", "shell_128", [] { return shell(128); }});
  all.push_back({"shell", "shell_64", [] { return shell(64); }});
  all.push_back({"shell", "shell_48", [] { return shell(48); }});
  all.push_back({"made", "sliding_20", sliding});
  const auto made = [&](const char* name, const std::function<stability::MotionPair()>& make) {
    all.push_back({"made", name, [make] { return known(make()); }});
  };
  made("waves_18", [] { return stability::folding_pair(64, 0.8, 18.0, 1); });
  made("waves_40", [] { return stability::folding_pair(64, 0.8, 40.0, 1); });
  made("noisy", [] { return stability::noisy_pair(64, 0.2, 3.0, 1); });
  made("thick_4", [] { return stability::thick_pair(64, 4.0, 8.0, 1); });
  made("shifted_12", [] { return stability::shifted_pair(64, 12.0, 8.0, 1); });
  return all;
}

double mean_error_mm(const Field& found, const KnownCase& pair, const Mask& mask) {
  return value_or_throw(endpoint_error(found, pair.truth, &mask)).mm.mean;
}

}  // namespace palpate::bench
