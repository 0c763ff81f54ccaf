#include "integration/files/frame_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <compare>
#include <map>
#include <optional>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;

bool is_digit_at(std::string_view text, size_t at) {
  return at < text.size() && std::isdigit(static_cast<unsigned char>(text[at]));
}

/// A number as it is written; its digits may be more than fit into any type.
struct WrittenNumber {
  char sign = 0;          ///< '+', '-', or none
  bool is_apart = false;  ///< no letter or digit stands before the sign
  std::string whole, fraction;

  bool is_negative() const { return sign == '-'; }
};

std::strong_ordering compare_digits(std::string_view a, std::string_view b) {
  while (a.starts_with('0')) a.remove_prefix(1);
  while (b.starts_with('0')) b.remove_prefix(1);
  if (a.size() != b.size()) return a.size() <=> b.size();
  return a.compare(b) <=> 0;
}

/// How the digits after a point are read: 1.10 is before 1.5 as a decimal, after it as a count.
enum class Reading { kDecimal, kCount };

std::strong_ordering compare(const WrittenNumber& a, const WrittenNumber& b, Reading reading) {
  if (a.is_negative() != b.is_negative()) return b.is_negative() <=> a.is_negative();
  auto order = compare_digits(a.whole, b.whole);
  if (order == 0 && reading == Reading::kCount) order = compare_digits(a.fraction, b.fraction);
  if (order == 0 && reading == Reading::kDecimal) {
    const size_t digits = std::max(a.fraction.size(), b.fraction.size());
    std::string x = a.fraction, y = b.fraction;
    x.resize(digits, '0'), y.resize(digits, '0');
    order = x.compare(y) <=> 0;
  }
  return a.is_negative() ? 0 <=> order : order;
}

/// The name of a file, cut into its numbers and what stands around them.
struct NumberedName {
  fs::path file;
  std::string pattern;  ///< in lower case, with a # for each number
  std::vector<WrittenNumber> numbers;
};

/// Without the ending of an image file.
std::string stem_of(const fs::path& file) {
  fs::path name = file.filename();
  if (lowered(name.extension().string()) == ".gz") name = name.stem();
  return name.stem().string();
}

NumberedName numbered(const fs::path& file) {
  NumberedName name{file, {}, {}};
  const std::string stem = lowered(stem_of(file));
  for (size_t at = 0; at < stem.size();) {
    const bool has_sign = stem[at] == '-' || stem[at] == '+';
    const auto is_word = [&](size_t k) {
      return std::isalnum(static_cast<unsigned char>(stem[k])) != 0;
    };
    // After a digit it is the hyphen of a date.
    const bool may_have_sign = has_sign && !(at > 0 && is_digit_at(stem, at - 1));
    if (!is_digit_at(stem, may_have_sign ? at + 1 : at)) {
      name.pattern += stem[at++];
      continue;
    }
    WrittenNumber number;
    if (may_have_sign) {
      number.is_apart = at == 0 || !is_word(at - 1);
      number.sign = stem[at++];
    }
    const auto digits = [&] {
      const size_t from = at;
      while (is_digit_at(stem, at)) ++at;
      return stem.substr(from, at - from);
    };
    const bool after_point = at > 1 && stem[at - 1] == '.' && is_digit_at(stem, at - 2);
    number.whole = digits();
    // Of numbers with several points, such as identifiers, each part is a number.
    size_t end = at + 1;
    while (is_digit_at(stem, end)) ++end;
    const bool goes_on = end < stem.size() && stem[end] == '.' && is_digit_at(stem, end + 1);
    if (!after_point && !goes_on && at < stem.size() && stem[at] == '.' &&
        is_digit_at(stem, at + 1)) {
      ++at;
      number.fraction = digits();
    }
    name.numbers.push_back(std::move(number));
    name.pattern += '#';
  }
  return name;
}

using NumberedNames = std::vector<NumberedName>;

std::string quoted(const fs::path& file) {
  return fmt::format("'{}'", file.filename().string());
}

/// A hyphen that stands before the same number of all names is no sign, unless it stands apart.
void drop_hyphens(NumberedNames& names, size_t n) {
  const bool all = std::all_of(names.begin(), names.end(), [&](const NumberedName& name) {
    return name.numbers[n].sign != 0 && !name.numbers[n].is_apart;
  });
  if (!all) return;
  for (NumberedName& name : names) name.numbers[n].sign = 0;
}

/// The numbers in which names of one pattern differ.
std::vector<size_t> differing(const NumberedNames& names) {
  std::vector<size_t> found;
  for (size_t n = 0; n < names.front().numbers.size(); ++n)
    if (std::any_of(names.begin(), names.end(), [&](const NumberedName& name) {
          return compare(name.numbers[n], names.front().numbers[n], Reading::kDecimal) != 0;
        }))
      found.push_back(n);
  return found;
}

std::strong_ordering compare(const NumberedName& a, const NumberedName& b,
                             const std::vector<size_t>& by, Reading reading) {
  for (const size_t n : by) {
    const auto order = compare(a.numbers[n], b.numbers[n], reading);
    if (order != 0) return order;
  }
  return std::strong_ordering::equal;
}

NumberedNames sorted(NumberedNames names, const std::vector<size_t>& by, Reading reading) {
  std::stable_sort(names.begin(), names.end(), [&](const NumberedName& a, const NumberedName& b) {
    return compare(a, b, by, reading) < 0;
  });
  return names;
}

/// Whole numbers that rise by the same step, but for gaps: the first name after a gap.
std::optional<size_t> gap_in(const NumberedNames& names, size_t n) {
  constexpr size_t kMostDigits = 15;  // of a whole number in a double
  std::vector<double> values;
  for (const NumberedName& name : names) {
    const WrittenNumber& number = name.numbers[n];
    if (number.whole.size() > kMostDigits || !number.fraction.empty()) return std::nullopt;
    values.push_back((number.is_negative() ? -1.0 : 1.0) * to_number(number.whole).value_or(0.0));
  }
  std::map<double, size_t> steps;
  for (size_t k = 1; k < values.size(); ++k) ++steps[values[k] - values[k - 1]];
  const auto usual = std::max_element(
      steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (steps.size() < 2 || 2 * usual->second < values.size()) return std::nullopt;
  for (size_t k = 1; k < values.size(); ++k)
    if (values[k] - values[k - 1] > usual->first) return k;
  return std::nullopt;
}

/// Orders names of one pattern.
Result<NamedFrames> ordered(const fs::path& folder, NumberedNames names) {
  for (size_t n = 0; n < names.front().numbers.size(); ++n) drop_hyphens(names, n);
  const std::vector<size_t> by = differing(names);
  names = sorted(std::move(names), by, Reading::kDecimal);
  const bool all_have_points = std::all_of(names.begin(), names.end(), [&](const auto& name) {
    return std::all_of(by.begin(), by.end(),
                       [&](size_t n) { return !name.numbers[n].fraction.empty(); });
  });
  if (all_have_points) {
    const NumberedNames counted = sorted(names, by, Reading::kCount);
    for (size_t k = 0; k < names.size(); ++k)
      if (counted[k].file != names[k].file)
        return bad_input(folder,
                         "has files whose order is not certain: by decimals {} comes before {}, by "
                         "counting after it; name them with the same number of digits",
                         quoted(names[k].file), quoted(counted[k].file));
  }
  for (size_t k = 1; k < names.size(); ++k)
    if (compare(names[k - 1], names[k], by, Reading::kDecimal) == 0)
      return bad_input(folder, "holds {} and {}, which have the same number: keep one of them",
                       quoted(names[k - 1].file), quoted(names[k].file));
  NamedFrames frames;
  for (const NumberedName& name : names) frames.files.push_back(name.file);
  // Several numbers that all rise say the same.
  const bool agree = std::all_of(by.begin(), by.end(), [&](size_t n) {
    return std::is_sorted(names.begin(), names.end(), [&](const auto& a, const auto& b) {
      return compare(a.numbers[n], b.numbers[n], Reading::kDecimal) < 0;
    });
  });
  if (!agree)
    frames.notes.push_back(
        fmt::format("The names of the frames differ in {} numbers that give different orders: they "
                    "are taken by the first number, then by the next, from {} to {}.",
                    by.size(), quoted(frames.files.front()), quoted(frames.files.back())));
  else if (const auto gap = by.size() == 1 ? gap_in(names, by.front()) : std::nullopt)
    frames.notes.push_back(fmt::format("Between {} and {} a number is missing: is a frame?",
                                       quoted(frames.files[*gap - 1]), quoted(frames.files[*gap])));
  return frames;
}

/// Bytes in rising order, or letters and digits alone, as shells of most languages sort.
bool is_in_order_of_letters(const std::vector<fs::path>& files) {
  std::vector<std::string> names, words;
  for (const fs::path& file : files) {
    names.push_back(file.string());
    words.push_back(lowered(names.back()));
    std::erase_if(words.back(), [](unsigned char c) { return !std::isalnum(c); });
  }
  return std::is_sorted(names.begin(), names.end()) || std::is_sorted(words.begin(), words.end());
}

}  // namespace

Result<NamedFrames> frames_by_name(const fs::path& folder, const std::vector<fs::path>& images) {
  std::map<std::string, fs::path> stems;
  std::map<std::string, NumberedNames> patterns;
  for (const fs::path& image : images) {
    const auto [same, is_new] = stems.emplace(lowered(stem_of(image)), image);
    if (!is_new)
      return bad_input(folder, "holds {} and {}, which have one name: keep one of them",
                       quoted(same->second), quoted(image));
    NumberedName name = numbered(image);
    patterns[name.pattern].push_back(std::move(name));
  }
  std::vector<const NumberedNames*> sequences;
  for (const auto& [pattern, names] : patterns)
    if (names.size() > 1) sequences.push_back(&names);
  if (sequences.size() > 1) {
    std::vector<std::string> choices;
    for (const NumberedNames* names : sequences)
      choices.push_back(fmt::format("'{}' ({} files)", names->front().pattern, names->size()));
    return bad_input(folder,
                     "holds {} sequences by the names of its files, {}: name the files of one",
                     sequences.size(), fmt::join(choices, ", "));
  }
  const size_t others = images.size() - (sequences.empty() ? 0 : sequences.front()->size());
  if (!sequences.empty() && sequences.front()->size() > others) {
    auto frames = ordered(folder, *sequences.front());
    if (!frames || others == 0) return frames;
    std::vector<std::string> names;
    for (const auto& [pattern, of_pattern] : patterns)
      if (of_pattern.size() == 1) names.push_back(quoted(of_pattern.front().file));
    frames->notes.push_back(fmt::format("Left out, because the {} frames are called '{}': {}.",
                                        frames->files.size(), sequences.front()->front().pattern,
                                        fmt::join(names, ", ")));
    return frames;
  }
  NamedFrames frames{images, {}};
  std::sort(frames.files.begin(), frames.files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(lowered(stem_of(a)), lowered(stem_of(b)));
  });
  std::vector<std::string> names;
  for (const fs::path& file : frames.files) names.push_back(quoted(file));
  if (images.size() > 1)
    frames.notes.push_back(
        fmt::format("The names of the frames say no order: they are taken by their letters, {}.",
                    fmt::join(names, ", ")));
  return frames;
}

Status check_listed_order(const std::vector<fs::path>& files) {
  if (files.size() < 3 || !is_in_order_of_letters(files)) return Nothing{};
  NumberedNames names;
  for (const fs::path& file : files) {
    names.push_back(numbered(file));
    if (names.back().pattern != names.front().pattern ||
        file.parent_path() != files.front().parent_path())
      return Nothing{};
  }
  for (size_t n = 0; n < names.front().numbers.size(); ++n) drop_hyphens(names, n);
  const std::vector<size_t> by = differing(names);
  for (size_t k = 1; k < names.size(); ++k)
    if (compare(names[k], names[k - 1], by, Reading::kDecimal) < 0)
      return bad_input(files[k],
                       "is listed after {}, in the order of letters, but has a lower number: name "
                       "the folder, or list the files in the order of their numbers (ls -v)",
                       quoted(files[k - 1]));
  return Nothing{};
}

}  // namespace palpate::files
