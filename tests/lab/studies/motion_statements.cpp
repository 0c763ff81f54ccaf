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

/// What to take for a wish.
struct Choice {
  double wish = 0.0;
  const MotionMeasure* row = nullptr;
};

/// The most accurate setting for each round number of seconds on the front. Each setting once.
std::vector<Choice> deadline_choices(const std::vector<const MotionMeasure*>& front) {
  std::vector<Choice> choices;
  if (front.empty()) return choices;
  std::vector<double> deadlines = round_numbers(front.front()->seconds, front.back()->seconds);
  // One above the slowest, so that the most accurate setting is there too.
  const auto beyond = round_numbers(front.back()->seconds, 10.0 * front.back()->seconds);
  if (!beyond.empty()) deadlines.push_back(beyond.front());
  for (const double deadline : deadlines) {
    const MotionMeasure* best = nullptr;
    for (const MotionMeasure* row : front)
      // In decreasing order of error.
      if (row->seconds <= deadline) best = row;
    if (best && (choices.empty() || choices.back().row != best))
      choices.push_back({deadline, best});
  }
  return choices;
}

/// The fastest setting for each round number of mm on the front, from coarse to fine.
std::vector<Choice> error_choices(const std::vector<const MotionMeasure*>& front) {
  std::vector<Choice> choices;
  if (front.empty()) return choices;
  auto wishes = round_numbers(front.back()->error_mm, 1.0001 * front.front()->error_mm);
  if (wishes.empty()) wishes.push_back(front.back()->error_mm);
  std::reverse(wishes.begin(), wishes.end());
  for (const double wish : wishes) {
    const auto fastest = std::find_if(front.begin(), front.end(), [&](const MotionMeasure* row) {
      return row->error_mm <= wish;
    });
    if (fastest != front.end() && (choices.empty() || choices.back().row != *fastest))
      choices.push_back({wish, *fastest});
  }
  return choices;
}

report::Cell percent(double ratio) {
  return report::number(100.0 * (ratio - 1.0), 0);
}

}  // namespace

std::string time_text(double seconds) {
  return seconds < 0.1 ? fmt::format("{:.3g} ms", 1e3 * seconds) : fmt::format("{:.3g} s", seconds);
}

std::vector<std::string> deadline_sentences(const MotionMeasures& measures) {
  std::vector<std::string> sentences;
  for (const auto& [deadline, row] : deadline_choices(front_rows(measures)))
    sentences.push_back(fmt::format("With {} for a pair, take \"{}\": {} in {}.",
                                    time_text(deadline), row->name, error_text(*row),
                                    time_text(row->seconds)));
  return sentences;
}

report::Table choice_table(const MotionMeasures& measures) {
  report::Table table{"What to take: " + measures.name,
                      "",
                      {{"wish", "at most"},
                       {"setting", "take"},
                       {"time_s", "s"},
                       {"error_mm", "error, mm"},
                       {"error_voxels", "voxels"}},
                      {}};
  const auto add = [&](std::string wish, const MotionMeasure& row) {
    table.rows.push_back({report::words(std::move(wish)), report::words(row.name),
                          report::number(row.seconds, 3), report::number(row.error_mm, 3),
                          report::number(row.error_voxels(), 3)});
  };
  const auto front = front_rows(measures);
  for (const Choice& choice : deadline_choices(front)) add(time_text(choice.wish), *choice.row);
  for (const Choice& choice : error_choices(front))
    add(fmt::format("{:.3g} mm", choice.wish), *choice.row);
  if (!front.empty()) add("the smallest error", *front.back());
  return table;
}

report::Table preset_table(const MotionMeasures& measures) {
  report::Table table{"Presets that are beaten: " + measures.name,
                      fmt::format("By a setting that is both faster by {:.0f} % and more accurate "
                                  "by {:.0f} %; the most accurate of these.",
                                  100.0 * kTimeMargin, 100.0 * kErrorMargin),
                      {{"preset", "preset"},
                       {"beaten_by", "beaten by"},
                       {"time_percent", "time, %"},
                       {"error_percent", "error, %"}},
                      {}};
  const auto ours = ours_of(measures);
  for (const MotionMeasure* preset : ours) {
    if (!preset->preset) continue;
    const MotionMeasure* better = nullptr;
    for (const MotionMeasure* row : ours)
      if (report::beats(row->costs(), preset->costs(), kTimeMargin, kErrorMargin) &&
          (!better || row->error_mm < better->error_mm))
        better = row;
    table.rows.push_back(
        {report::words(preset->name), report::words(better ? better->name : "none"),
         better ? percent(better->seconds / preset->seconds) : report::nothing(),
         better ? percent(better->error_mm / preset->error_mm) : report::nothing()});
  }
  return table;
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

report::Table sweep_table(const MotionMeasures& measures) {
  report::Table table{
      "What each change does: " + measures.name,
      fmt::format("Compared with the preset. Less than {:.0f} % of time or {:.0f} % "
                  "of error is no difference.",
                  100.0 * kTimeMargin, 100.0 * kErrorMargin),
      {{"preset", "preset"},
       {"change", "with"},
       {"time_percent", "time, %"},
       {"error_percent", "error, %"}},
      {}};
  for (const MotionMeasure& row : measures.rows) {
    if (!row.ours || row.preset) continue;
    const std::string preset = row.name.substr(0, row.name.find(','));
    const auto base =
        std::find_if(measures.rows.begin(), measures.rows.end(),
                     [&](const MotionMeasure& r) { return r.preset && r.name == preset; });
    if (base == measures.rows.end() || row.name.size() < preset.size() + 2) continue;
    table.rows.push_back({report::words(preset), report::words(row.name.substr(preset.size() + 2)),
                          percent(row.seconds / base->seconds),
                          percent(row.error_mm / base->error_mm)});
  }
  return table;
}

}  // namespace palpate::studies
