#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace lowlux::isp {

/// Keeps the first message libtiff has for one file, instead of printing it.
struct TiffMessages {
  std::string first_error;

  __attribute__((format(printf, 2, 0))) void keep(const char* format, std::va_list arguments) {
    if (!first_error.empty()) return;
    char line[200];
    std::vsnprintf(line, sizeof line, format, arguments);
    first_error = line;
  }
};

}  // namespace lowlux::isp
