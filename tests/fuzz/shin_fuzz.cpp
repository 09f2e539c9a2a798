// Tables of Shin's coefficients from arbitrary text: what is accepted has rising nodes, and coefficients between them
// that are finite.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "isp/model/appearance/shin_table.h"
#include "tests/fuzz/input.h"

using lowlux::test::require;

LOWLUX_FUZZ_TARGET(shin)(const std::uint8_t* data, std::size_t size) {
  const auto table = lowlux::isp::read_shin_table({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!table) {
    require(!table.error().message.empty() && table.error().message.find('\n') == std::string::npos);
    return 0;
  }
  const auto& nodes = table->nodes;
  require(nodes.size() >= 2 && nodes.size() <= 1000);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    require(nodes[i].e > 0 && std::isfinite(nodes[i].e) && (i == 0 || nodes[i].e > nodes[i - 1].e));
    const double between = i == 0 ? nodes[i].e / 2 : std::sqrt(nodes[i].e) * std::sqrt(nodes[i - 1].e);
    if (between == 0) continue;  // half of the least number there is
    const auto c = lowlux::isp::shin_coefficients(*table, between);
    for (const double figure : {c.alpha, c.beta, c.l, c.a, c.m, c.b}) require(std::isfinite(figure));
  }
  return 0;
}
