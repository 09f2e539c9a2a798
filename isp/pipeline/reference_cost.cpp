#include "isp/pipeline/reference_cost.h"

#include <string>
#include <vector>

namespace lowlux::isp {
namespace {

/// The fixed piece of work of isp/bench/pace.h, 0.79 MP at the level standard, by the table below: 13 ms/MP. It was not
/// recorded with the times.
constexpr double pace_s = 0.0105;

CostModel made() {
  const std::array<std::vector<CostPoint>, cost_parts> points{{
      {{9.009, 0.00689}},  // planning
      {{1.573, 0.00485}},  // samples
      {{9.009, 0.00332}},  // defects
      {{9.009, 0.01588}},  // lines
      {{9.009, 0.00749}},  // offsets
      {{9.009, 0.00286}},  // check
      {{9.009, 0.01073}},  // codes
      {{9.009, 0.01477}},  // floats
      {{9.503, 0.08067}},  // draft-0
      {{9.503, 0.06221}},  // draft-1
      {{9.503, 0.05397}},  // draft-2
      {{9.503, 0.11338}},  // standard-0
      {{9.503, 0.07613}},  // standard-1
      {{9.503, 0.06720}},  // standard-2
      {{9.503, 0.14581}},  // high-0
      {{9.503, 0.08701}},  // high-1
      {{9.503, 0.07957}},  // high-2
      {{2.064, 1.14255}},  // best-0
      {{2.064, 0.42458}},  // best-2
      {{9.009, 0.00805}},  // codes-16
      {{9.009, 0.00000}},  // floats-32
      {{9.009, 0.01160}},  // look
      {{9.009, 0.02373}},  // display
  }};
  return {.machine = std::string(reference_machine), .threads = 2, .pace_s = pace_s, .points = points};
}

}  // namespace

const CostModel& reference_cost() {
  static const CostModel model = made();
  return model;
}

}  // namespace lowlux::isp
