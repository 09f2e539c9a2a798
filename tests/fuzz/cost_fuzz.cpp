// Cost models from arbitrary text: what is accepted has times that can be, at rising sizes and between them, and
// written again it is the same model.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "isp/cli/develop/cost_file.h"
#include "tests/fuzz/input.h"

namespace {

using lowlux::isp::CostModel;
using lowlux::isp::CostPart;
using lowlux::isp::CostPoint;
using lowlux::test::require;

bool can_be(double seconds) { return seconds >= 0 && std::isfinite(seconds); }

void check(const std::vector<CostPoint>& points) {
  require(!points.empty());
  double before = 0;
  for (const CostPoint& point : points) {
    require(point.megapixels > before && std::isfinite(point.megapixels) && can_be(point.seconds));
    before = point.megapixels;
  }
}

/// Within the measured sizes a time is one between those measured; beyond them it is held to no more than a number.
void check_times(const CostModel& model, CostPart part) {
  const std::vector<CostPoint>& points = model.points[static_cast<std::size_t>(part)];
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double between = points[i - 1].megapixels / 2 + points[i].megapixels / 2;
    require(can_be(model.seconds(part, {between, between})));
  }
  for (const double megapixels : {1e-6, 1e5}) require(model.seconds(part, {megapixels, megapixels}) >= 0);
}

void require_same(const CostModel& a, const CostModel& b) {
  require(a.machine == b.machine && a.threads == b.threads && a.pace_s == b.pace_s && a.pace == b.pace);
  for (std::size_t part = 0; part < a.points.size(); ++part) {
    require(a.points[part].size() == b.points[part].size());
    for (std::size_t i = 0; i < a.points[part].size(); ++i) {
      const CostPoint &of_a = a.points[part][i], &of_b = b.points[part][i];
      require(of_a.megapixels == of_b.megapixels && of_a.seconds == of_b.seconds);
    }
  }
}

}  // namespace

LOWLUX_FUZZ_TARGET(cost)(const std::uint8_t* data, std::size_t size) {
  const auto model = lowlux::cli::parse_cost({reinterpret_cast<const char*>(data), size});
  if (!model) {
    require(!model.error().message.empty() && model.error().message.find('\n') == std::string::npos);
    return 0;
  }
  require(model->threads >= 1 && can_be(model->pace_s) && model->pace == 1);
  for (int i = 0; i < lowlux::isp::cost_parts; ++i) {
    check(model->points[static_cast<std::size_t>(i)]);
    check_times(*model, static_cast<CostPart>(i));
  }
  const auto again = lowlux::cli::parse_cost(lowlux::cli::cost_text(*model));
  require(again.has_value());
  require_same(*model, *again);
  return 0;
}
