#pragma once

#include <string>

#include "isp/base/result.h"

namespace lowlux::test {

/// Returns whether an error's message holds these words.
inline bool has(const Error& error, const std::string& words) { return error.message.find(words) != std::string::npos; }

}  // namespace lowlux::test
