#pragma once

#include <array>
#include <memory>
#include <vector>

#include "isp/pipeline/cost_model.h"

namespace lowlux::test {

/// What one machine took (two cores of an AMD EPYC, `lowlux bench --calibrate-cost`) for large frames: tests that
/// compare plans by their predicted time are the same everywhere, and of small frames they say what holds for large
/// ones that are searched whole.
inline std::shared_ptr<const isp::CostModel> reference_cost() {
  static const std::array<std::vector<isp::CostPoint>, isp::cost_parts> points{{
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
  static const auto model = std::make_shared<const isp::CostModel>(
      isp::CostModel{.machine = "the reference of tests", .threads = 2, .points = points});
  return model;
}

}  // namespace lowlux::test
