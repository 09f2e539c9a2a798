#pragma once

#include <cstdio>
#include <string>

namespace lowlux::capture {

/// A number for a message: "12.5", "65535", "nan".
inline std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

}  // namespace lowlux::capture
