#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include "isp/base/estimate.h"
#include "isp/output/report/report.h"

/// The one way of the command to stdout and stderr. Nothing is thrown: what a stream did not take is lost, and
/// std::ferror() says so. main() turns lost output into an exit code.

namespace lowlux::cli {

/// The text with every control character made a blank, so that no file name can break a line.
std::string one_line(std::string text);

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

inline void print_text(std::FILE* stream, std::string_view text) { std::fwrite(text.data(), 1, text.size(), stream); }
inline void print_out(std::string_view text) { print_text(stdout, text); }
inline void print_err(std::string_view text) { print_text(stderr, text); }

/// The pixels of the 2x2 cell, for a table.
inline constexpr std::array site_names = {"site 00", "site 01", "site 10", "site 11"};

/// The two numbers of an estimate, for a table.
struct EstimateCells {
  std::string value;
  std::string standard_error;  // empty if there is none
};

/// Two digits of the standard error, and as many decimals of the value; without a standard error five digits.
EstimateCells cells_of(const Estimate& estimate);

/// The same in one text: "2047.30 +- 0.24".
std::string text_of(const Estimate& estimate);

}  // namespace lowlux::cli
