#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "isp/cli/report.h"

namespace lowlux::cli {

/// Text of labelled lines.
class Lines {
 public:
  void add(std::string_view label, std::string_view text) {
    constexpr std::size_t width = 15;
    text_.append("  ")
        .append(label)
        .append(width - std::min(width, label.size()), ' ')
        .append(one_line(std::string(text)))
        .append("\n");
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace lowlux::cli
