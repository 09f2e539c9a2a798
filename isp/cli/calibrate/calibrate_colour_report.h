#pragma once

#include <string>

#include "isp/base/image.h"
#include "isp/cli/calibrate/calibrate_colour_work.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {

/// The patches in a table, what was found, and a line for each matrix.
std::string colour_text(const ColourOutcome& outcome);
/// One JSON object.
std::string colour_json(const ColourOutcome& outcome, const std::string& profile);
/// Differences and a*b* of the patches, drawn; and the tables. @param profile  file it is written to
isp::Report colour_report(const ColourOutcome& outcome, const std::string& profile);

/// The half-size picture, white by the chart, with the outline of what was measured of each patch; the first patch's is
/// red. Display codes, as the sensor lies.
Encoded8 colour_overlay(const MeasuredChart& chart);

}  // namespace lowlux::cli
