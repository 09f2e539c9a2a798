#pragma once

namespace lowlux::cli {

/// Prints the connected cameras, for people or as JSON. @return the exit code: 0 also if there are none
int list_cameras(bool json);

}  // namespace lowlux::cli
