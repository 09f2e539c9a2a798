#include "isp/model/appearance/shin_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t columns = 7;
constexpr std::size_t max_nodes = 1000;
constexpr std::string_view separators = ", \t\r;";

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  words.reserve(columns);
  while (words.size() <= columns) {
    line.remove_prefix(std::min(line.find_first_not_of(separators), line.size()));
    if (line.empty()) break;
    const std::size_t length = std::min(line.find_first_of(separators), line.size());
    words.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  double value = 0;
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  if (read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

tl::unexpected<Error> malformed(int line, const std::string& what) {
  return fail(ErrorCode::malformed, "line " + std::to_string(line) + " of the coefficients: " + what);
}

Result<ShinTable::Node> node_of(const std::vector<std::string_view>& words, int line) {
  if (words.size() != columns) {
    return malformed(line, "expected E, alpha, beta, l, a, m, b, found " +
                               (words.size() > columns ? std::string("more") : std::to_string(words.size())) +
                               (words.size() == 1 ? " column" : " columns"));
  }
  std::array<double, columns> value{};
  for (std::size_t i = 0; i < columns; ++i) {
    const auto number = number_of(words[i]);
    if (!number)
      return malformed(line, "expected a finite number, found \"" + std::string(words[i].substr(0, 40)) + '"');
    value[i] = *number;
  }
  return ShinTable::Node{value[0], {value[1], value[2], value[3], value[4], value[5], value[6]}};
}

std::string_view take_line(std::string_view& text) {
  const std::size_t length = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, length);
  text.remove_prefix(std::min(length + 1, text.size()));
  return line.substr(0, line.find('#'));
}

}  // namespace

Result<ShinTable> read_shin_table(std::string_view text, std::string name) {
  ShinTable table{std::move(name), {}};
  bool may_be_words = true;
  for (int line = 1; !text.empty(); ++line) {
    const auto words = words_of(take_line(text));
    if (words.empty()) continue;
    const bool is_heading = std::exchange(may_be_words, false) && words.size() == columns && !number_of(words.front());
    if (is_heading) continue;
    auto node = node_of(words, line);
    if (!node) return tl::make_unexpected(node.error());
    const double before = table.nodes.empty() ? 0 : table.nodes.back().e;
    if (!(node->e > before)) {
      return malformed(line,
                       "E must be positive and rise, found " + number_text(node->e) + " after " + number_text(before));
    }
    if (table.nodes.size() == max_nodes) {
      return fail(ErrorCode::too_large, "a table of coefficients may have 1000 lines, this one has more");
    }
    table.nodes.push_back(*node);
  }
  if (table.nodes.size() < 2) {
    return fail(ErrorCode::malformed,
                "a table of coefficients needs at least two lines of E, alpha, beta, l, a, m, b, found " +
                    std::to_string(table.nodes.size()));
  }
  return table;
}

const ShinTable& shin_substitute() {
  static const ShinTable table{std::string(shin_substitute_name), {}};
  return table;
}

namespace {

ShinCoefficients substitute_at(double e) {
  const double decade = std::log10(e);
  const double alpha = mesopic_state({e, scotopic_ratio_of_equal_energy * e}).m;
  return {.alpha = alpha,
          .beta = 1 - alpha,
          .l = 0.1 + 0.9 * std::clamp((decade + 1) / 4, 0.0, 1.0),
          .a = 0,
          .m = 0.1 + 0.9 * std::clamp(decade / 3, 0.0, 1.0),
          .b = 0};
}

}  // namespace

ShinCoefficients shin_coefficients(const ShinTable& table, double e) {
  if (table.nodes.empty()) return substitute_at(e);
  const auto above = std::ranges::find_if(table.nodes, [&](const ShinTable::Node& node) { return node.e > e; });
  if (above == table.nodes.begin()) return above->coefficients;
  const auto below = above - 1;
  if (above == table.nodes.end()) return below->coefficients;
  const double t = std::log(e / below->e) / std::log(above->e / below->e);
  const ShinCoefficients &p = below->coefficients, &q = above->coefficients;
  return {std::lerp(p.alpha, q.alpha, t), std::lerp(p.beta, q.beta, t), std::lerp(p.l, q.l, t),
          std::lerp(p.a, q.a, t),         std::lerp(p.m, q.m, t),       std::lerp(p.b, q.b, t)};
}

}  // namespace lowlux::isp
