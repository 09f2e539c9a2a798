#pragma once

#include <string>

namespace lowlux::capture {

/// Returns the name of the decoder of raw files for messages, "LibRaw 0.20.2".
std::string decoder_name();

}  // namespace lowlux::capture
