#pragma once

#include <string>
#include <vector>

#include "isp/model/exposure_advice.h"

namespace lowlux::isp {

/// The errors of advise_exposure() that its request shows by itself.
Result<void> check_request(const AdviceRequest& request);

/// Why the best gain is the best: what limits its exposure, what its neighbours would lose, and what its noise is made
/// of. One sentence without a final stop.
/// @param losses_db  of each gain against the best of all [dB]
std::string advice_reason(const AdviceRequest& request, const ExposureAdvice& advice,
                          const std::vector<double>& losses_db);

}  // namespace lowlux::isp
