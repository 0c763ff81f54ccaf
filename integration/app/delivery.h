#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compute/motion/verdict.h"
#include "integration/app/estimation.h"
#include "integration/app/motion_page.h"
#include "integration/app/outputs.h"
#include "integration/app/summary.h"

namespace palpate::app {

/// File names of one pair; a file with an empty name is not written.
struct PairNames {
  std::string field;
  std::string inverse;
  std::string confidence;
  std::string deviation;
  std::string picture;
};

struct DeliveryOptions {
  std::function<PairNames(size_t fixed, size_t moving)> names;
  bool coarse = false;  ///< write on the solved grid instead of the image's
  bool judge = true;
  bool cyclic = false;
  std::string ordered_by;      ///< what gives the order of the frames, for people
  const Mask* mask = nullptr;  ///< on the frames' grid
  MotionPage* page = nullptr;  ///< gets all frames and steps; null: none
};

/// Takes each estimated pair: writes, judges and draws it, and prints a line about it. One thread
/// at a time.
class Delivery {
 public:
  Delivery(DeliveryOptions options, Outputs& outputs, Console& console);

  /// kBadOutput if a file can not be written.
  Status take(const EstimatedPair& pair);

  /// The verdict on all pairs so far; for a cycle also on its drift.
  Verdict verdict() const;
  const std::optional<CycleDrift>& drift() const { return drift_; }

  /// The evidence on the last pair, if it was judged.
  const Evidence& evidence() const { return delivered_.back().evidence; }
  /// The longest time for a pair, s.
  double slowest_s() const;

  /// What a page draws over the fixed frames of all pairs.
  std::vector<MotionPage::FrameCurve> curves() const;

  /// One object per pair: frames, files, motion, cost, evidence, verdict.
  nlohmann::json pairs() const;

  /// To be called after the last pair, before verdict(): measures the drift of a cycle.
  Status close_cycle();

 private:
  struct Delivered {
    size_t fixed = 0;
    size_t moving = 0;
    PairNames names;
    Spread motion_mm;
    SolveReport report;
    Evidence evidence;
  };

  Status write(const EstimatedPair& pair, const Field& field, const PairNames& names);
  Status draw(const EstimatedPair& pair, const Field& field, const std::string& name);
  void tell(const Delivered& pair);

  /// Stages a file and calls `write` for it; an error names the final path.
  template <class Write>
  Status put(const std::string& name, const Write& write);

  const DeliveryOptions options_;
  Outputs& outputs_;
  Console& console_;
  std::vector<Delivered> delivered_;
  std::optional<CyclePoints> everywhere_, where_structure_;
  std::optional<FrameOrderMeter> order_;
  std::optional<CycleDrift> drift_;
};

}  // namespace palpate::app
