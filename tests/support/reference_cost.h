#pragma once

#include <memory>

#include "isp/pipeline/cost_model.h"

namespace lowlux::test {

/// What one machine took (two cores of an AMD EPYC, `lowlux bench --calibrate-cost`): tests that compare plans by their
/// predicted time are the same everywhere.
inline std::shared_ptr<const isp::CostModel> reference_cost() {
  static const auto model = std::make_shared<const CostModel>(
      CostModel{"the reference of tests",
                2,
                {{
                    {{0.301, 0.0078}, {1.991, 0.0131}, {9.009, 0.0919}},  // planning
                    {{0.301, 0.0048}, {1.991, 0.0317}, {9.009, 0.1306}},  // defects
                    {{0.301, 0.0034}, {1.991, 0.0326}, {9.009, 0.2214}},  // lines
                    {{0.301, 0.0025}, {1.991, 0.0115}, {9.009, 0.0079}},  // check
                    {{0.301, 0.0013}, {1.991, 0.0065}, {9.009, 0.0426}},  // codes
                    {{0.301, 0.0022}, {1.991, 0.0113}, {9.009, 0.0691}},  // floats
                    {{0.301, 0.0115}, {1.991, 0.1059}, {9.009, 0.3049}},  // draft-0
                    {{0.301, 0.0069}, {1.991, 0.0971}, {9.009, 0.2635}},  // draft-1
                    {{0.301, 0.0080}, {1.991, 0.1067}, {9.009, 0.2534}},  // draft-2
                    {{0.301, 0.0172}, {1.991, 0.1483}, {9.009, 0.4897}},  // standard-0
                    {{0.301, 0.0125}, {1.991, 0.1340}, {9.009, 0.3989}},  // standard-1
                    {{0.301, 0.0110}, {1.991, 0.0894}, {9.009, 0.3219}},  // standard-2
                    {{0.301, 0.0199}, {1.991, 0.1797}, {9.009, 0.5872}},  // high-0
                    {{0.301, 0.0121}, {1.991, 0.1108}, {9.009, 0.3758}},  // high-1
                    {{0.301, 0.0125}, {1.991, 0.0888}, {9.009, 0.3061}},  // high-2
                    {{0.301, 0.8118}},                                    // best-0
                    {{0.301, 0.3611}},                                    // best-2
                    {{0.301, 0.0002}, {1.991, 0.0060}, {9.009, 0.0634}},  // codes-16
                    {{0.301, 0.0007}, {1.991, 0.0000}, {9.009, 0.0397}},  // floats-32
                    {{0.301, 0.0026}, {1.991, 0.0077}, {9.009, 0.0556}},  // look
                    {{0.301, 0.0040}, {1.991, 0.0260}, {9.009, 0.1200}},  // display
                }}});
  return model;
}

}  // namespace lowlux::test
