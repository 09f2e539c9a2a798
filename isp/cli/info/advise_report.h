#pragma once

#include <string>

#include "isp/cli/info/advise_camera.h"
#include "isp/model/sensor/exposure_advice.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {

/// Returns the advice, each gain's best, and the curve, for people.
std::string advice_text(const AdviceCase& asked, const isp::ExposureAdvice& advice);

/// Returns the advice as one JSON object; null where the mid tone clips.
std::string advice_json(const AdviceCase& asked, const isp::ExposureAdvice& advice);

/// Returns the advice as a page, with signal-to-noise ratio and chromaticity drawn over the exposure for each gain.
isp::Report advice_page(const AdviceCase& asked, const isp::ExposureAdvice& advice);

}  // namespace lowlux::cli
