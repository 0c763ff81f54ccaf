#include "tests/lab/studies/motion_statements.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "integration/app/choice/motion_front.h"

namespace palpate::studies {
namespace {

std::vector<const MotionMeasure*> ours_of(const MotionMeasures& measures) {
  std::vector<const MotionMeasure*> ours;
  for (const MotionMeasure& row : measures.rows)
    if (row.ours) ours.push_back(&row);
  return ours;
}

std::vector<const MotionMeasure*> front_rows(const MotionMeasures& measures) {
  const auto ours = ours_of(measures);
  std::vector<report::Costs> costs;
  for (const MotionMeasure* row : ours) costs.push_back(row->costs());
  std::vector<const MotionMeasure*> front;
  for (const size_t n : report::pareto_front(costs)) front.push_back(ours[n]);
  return front;
}

/// 1, 2 and 5 times powers of ten within (low, high].
std::vector<double> round_numbers(double low, double high) {
  std::vector<double> numbers;
  for (int decade = int(std::floor(std::log10(low))); decade <= int(std::ceil(std::log10(high)));
       ++decade)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * std::pow(10.0, decade);
      if (value > low && value <= high) numbers.push_back(value);
    }
  return numbers;
}

std::string error_text(const MotionMeasure& row) {
  return fmt::format("{:.3g} mm ({:.2g} voxels)", row.error_mm, row.error_voxels());
}

std::string change_text(double ours, double other, double margin, const char* less,
                        const char* more) {
  const double change = ours / other - 1.0;
  if (std::abs(change) <= margin) return "";
  return fmt::format("{:.0f} % {}", 100.0 * std::abs(change), change < 0 ? less : more);
}

}  // namespace

std::string time_text(double seconds) {
  return seconds < 0.1 ? fmt::format("{:.3g} ms", 1e3 * seconds) : fmt::format("{:.3g} s", seconds);
}

std::vector<std::string> deadline_sentences(const MotionMeasures& measures) {
  const auto front = front_rows(measures);
  std::vector<std::string> sentences;
  if (front.empty()) return sentences;
  const MotionMeasure* last = nullptr;
  std::vector<double> deadlines = round_numbers(front.front()->seconds, front.back()->seconds);
  // One above the slowest, so that the most accurate setting has a sentence too.
  const auto beyond = round_numbers(front.back()->seconds, 10.0 * front.back()->seconds);
  if (!beyond.empty()) deadlines.push_back(beyond.front());
  for (const double deadline : deadlines) {
    const MotionMeasure* best = nullptr;
    for (const MotionMeasure* row : front)
      // In decreasing order of error.
      if (row->seconds <= deadline) best = row;
    if (!best || best == last) continue;
    sentences.push_back(fmt::format("With {} for a pair, take \"{}\": {} in {}.",
                                    time_text(deadline), best->name, error_text(*best),
                                    time_text(best->seconds)));
    last = best;
  }
  return sentences;
}

std::vector<std::string> error_sentences(const MotionMeasures& measures) {
  const auto front = front_rows(measures);
  std::vector<std::string> sentences;
  if (front.empty()) return sentences;
  const MotionMeasure* last = nullptr;
  auto wishes = round_numbers(front.back()->error_mm, 1.0001 * front.front()->error_mm);
  if (wishes.empty()) wishes.push_back(front.back()->error_mm);
  std::reverse(wishes.begin(), wishes.end());
  for (const double wish : wishes) {
    const auto fastest = std::find_if(front.begin(), front.end(), [&](const MotionMeasure* row) {
      return row->error_mm <= wish;
    });
    if (fastest == front.end() || *fastest == last) continue;
    sentences.push_back(fmt::format("For an error of at most {:.3g} mm, take \"{}\": {} in {}.",
                                    wish, (*fastest)->name, error_text(**fastest),
                                    time_text((*fastest)->seconds)));
    last = *fastest;
  }
  sentences.push_back(fmt::format("The smallest error of all is {}, by \"{}\".",
                                  error_text(*front.back()), front.back()->name));
  return sentences;
}

std::vector<std::string> preset_sentences(const MotionMeasures& measures) {
  const auto ours = ours_of(measures);
  std::vector<std::string> unbeaten, sentences;
  for (const MotionMeasure* preset : ours) {
    if (!preset->preset) continue;
    const MotionMeasure* better = nullptr;
    for (const MotionMeasure* row : ours) {
      if (!report::beats(row->costs(), preset->costs(), kTimeMargin, kErrorMargin)) continue;
      if (!better || row->error_mm < better->error_mm) better = row;
    }
    if (!better) {
      unbeaten.push_back(preset->name);
      continue;
    }
    sentences.push_back(fmt::format(
        "\"{}\" is beaten by \"{}\": {} instead of {}, and {:.0f} % less error.", preset->name,
        better->name, time_text(better->seconds), time_text(preset->seconds),
        100.0 * (1.0 - better->error_mm / preset->error_mm)));
  }
  if (!unbeaten.empty()) {
    std::string names;
    for (size_t n = 0; n < unbeaten.size(); ++n)
      names += (n == 0                     ? ""
                : n + 1 == unbeaten.size() ? " and "
                                           : ", ") +
               ("\"" + unbeaten[n] + "\"");
    sentences.insert(
        sentences.begin(),
        fmt::format("No other setting of palpate is both faster (by {:.0f} %) and more "
                    "accurate (by {:.0f} %) than {}.",
                    100.0 * kTimeMargin, 100.0 * kErrorMargin, names));
  }
  return sentences;
}

std::string peer_sentence(const MotionMeasures& measures) {
  const MotionMeasure* peer = nullptr;
  for (const MotionMeasure& row : measures.rows)
    if (!row.ours && (!peer || row.error_mm < peer->error_mm)) peer = &row;
  if (!peer) return "";
  const std::string about = fmt::format("The most accurate peer is {} ({}): {} in {}.", peer->name,
                                        peer->family, error_text(*peer), time_text(peer->seconds));
  const MotionMeasure* ours = nullptr;
  for (const MotionMeasure& row : measures.rows)
    if (row.preset && row.error_mm <= peer->error_mm && (!ours || row.seconds < ours->seconds))
      ours = &row;
  if (!ours) return about + " No preset of palpate is as accurate here.";
  const double ratio = peer->seconds / ours->seconds;
  return about + fmt::format(" \"{}\" is at least as accurate ({}) in {}, {}.", ours->name,
                             error_text(*ours), time_text(ours->seconds),
                             ratio >= 1.0 ? fmt::format("{:.3g} times sooner", ratio)
                                          : fmt::format("{:.3g} times later", 1.0 / ratio));
}

std::vector<std::string> sweep_sentences(const MotionMeasures& measures) {
  std::vector<std::string> sentences;
  for (const MotionMeasure& row : measures.rows) {
    if (!row.ours || row.preset) continue;
    const std::string preset = row.name.substr(0, row.name.find(','));
    const auto base =
        std::find_if(measures.rows.begin(), measures.rows.end(),
                     [&](const MotionMeasure& r) { return r.preset && r.name == preset; });
    if (base == measures.rows.end() || row.name.size() < preset.size() + 2) continue;
    const std::string time =
                          change_text(row.seconds, base->seconds, kTimeMargin, "faster", "slower"),
                      error = change_text(row.error_mm, base->error_mm, kErrorMargin, "less error",
                                          "more error");
    std::string change = time.empty() && error.empty() ? "no difference"
                         : time.empty()                ? error + ", as fast"
                         : error.empty()               ? time + ", as accurate"
                                                       : time + ", " + error;
    sentences.push_back(
        fmt::format("{}, with {}: {}.", preset, row.name.substr(preset.size() + 2), change));
  }
  return sentences;
}

}  // namespace palpate::studies
