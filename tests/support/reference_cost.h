#pragma once

#include <memory>

#include "isp/pipeline/budget/cost_model.h"

namespace lowlux::test {

/// Returns isp::reference_cost() without a pace, so that times do not depend on the machine that runs the tests: tests
/// that compare plans by their predicted time are the same everywhere, and for small frames they state what holds for
/// large ones that are searched entirely.
inline std::shared_ptr<const isp::CostModel> reference_cost() {
  static const auto model = [] {
    auto without_pace = std::make_shared<isp::CostModel>(isp::reference_cost());
    without_pace->pace_s = 0;
    return std::shared_ptr<const isp::CostModel>(without_pace);
  }();
  return model;
}

}  // namespace lowlux::test
