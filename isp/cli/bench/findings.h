#pragma once

#include <span>
#include <string>

#include "isp/reproduce/reproduce.h"

namespace lowlux::cli {

/// Returns the findings as a table for a terminal: finding, kind, published, ours, verdict, wrapped to about 120
/// columns; the note follows where a finding does not agree. The last lines count the verdicts of published findings
/// and of this project's own checks, and state the tolerances.
std::string findings_text(std::span<const isp::Finding> findings);

/// Returns the parts of the thesis that no experiment reproduces, with the reasons.
std::string not_reproduced_text();

/// Returns one JSON array of objects.
std::string findings_json(std::span<const isp::Finding> findings);

}  // namespace lowlux::cli
