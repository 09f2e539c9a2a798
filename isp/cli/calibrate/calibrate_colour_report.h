#pragma once

#include <string>

#include "isp/base/image.h"
#include "isp/cli/calibrate/calibrate_colour_work.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {

/// Returns the patches in a table, the results, and a line for each matrix.
std::string colour_text(const ColourOutcome& outcome);
/// Returns one JSON object.
std::string colour_json(const ColourOutcome& outcome, const std::string& profile);
/// Returns a page with plots of differences and a*b* of the patches, and tables. @param profile  file it is written to
isp::Report colour_report(const ColourOutcome& outcome, const std::string& profile);

/// Returns the half-size image, white balanced by the chart, with the outline of the measured area of each patch; the
/// first patch's is red. It holds display codes, in the sensor's orientation.
Encoded8 colour_overlay(const MeasuredChart& chart);

}  // namespace lowlux::cli
