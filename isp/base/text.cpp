#include "isp/base/text.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <tuple>

namespace lowlux {
namespace {

constexpr std::size_t longest_wanted = 64;  // bytes: bounds the work on untrusted input
constexpr std::size_t max_matches = 3;

std::size_t common_beginning(std::string_view a, std::string_view b) {
  const std::size_t shorter = std::min(a.size(), b.size());
  std::size_t n = 0;
  while (n < shorter && ascii_lower(a[n]) == ascii_lower(b[n])) ++n;
  return n;
}

/// Returns the edit distance from the rows of the usual table, of which three are kept; a.size() <= longest_wanted.
std::size_t distance(std::string_view a, std::string_view b) {
  using Row = std::array<std::size_t, longest_wanted + 1>;
  Row before_last{}, last{}, row{};
  for (std::size_t i = 0; i <= a.size(); ++i) last[i] = i;
  for (std::size_t j = 1; j <= b.size(); ++j) {
    row[0] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
      const std::size_t replaced = last[i - 1] + (ascii_lower(a[i - 1]) == ascii_lower(b[j - 1]) ? 0 : 1);
      row[i] = std::min({replaced, last[i] + 1, row[i - 1] + 1});
      if (i > 1 && j > 1 && ascii_lower(a[i - 1]) == ascii_lower(b[j - 2]) &&
          ascii_lower(a[i - 2]) == ascii_lower(b[j - 1])) {
        row[i] = std::min(row[i], before_last[i - 2] + 1);
      }
    }
    before_last = last;
    last = row;
  }
  return last[a.size()];
}

/// Returns the sort key of a name; nullopt if it is not near. A name that begins with `wanted` is one edit away: the
/// missing letters are all at its end.
std::optional<std::tuple<std::size_t, std::size_t>> rank(std::string_view wanted, std::string_view name) {
  const std::size_t common = common_beginning(wanted, name);
  const std::size_t allowed = std::max<std::size_t>(1, wanted.size() / 3);
  std::size_t edits = allowed + 1;
  if (name.size() <= wanted.size() + allowed) edits = distance(wanted, name);
  if (common == wanted.size()) edits = std::min<std::size_t>(edits, 1);
  if (edits > allowed) return std::nullopt;
  return std::tuple{edits, longest_wanted - common};
}

}  // namespace

std::vector<std::string_view> near_matches(std::string_view wanted, std::span<const std::string_view> known) {
  if (wanted.empty() || wanted.size() > longest_wanted) return {};
  std::vector<std::tuple<std::size_t, std::size_t, std::size_t>> near;  // edits, letters not in common, index
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (const auto ranked = rank(wanted, known[i])) near.push_back(std::tuple_cat(*ranked, std::tuple{i}));
  }
  std::sort(near.begin(), near.end());
  std::vector<std::string_view> out;
  for (std::size_t i = 0; i < std::min(near.size(), max_matches); ++i) out.push_back(known[std::get<2>(near[i])]);
  return out;
}

}  // namespace lowlux
