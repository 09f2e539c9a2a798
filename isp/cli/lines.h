#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "isp/cli/report.h"
#include "isp/output/report.h"

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

/// Lines of a table, whose columns are as wide as their widest cell: words, in the first column and from `words_from`
/// on, are aligned at their left, figures at their right.
std::string aligned_text(const isp::Table& table, std::size_t words_from);

}  // namespace lowlux::cli
