#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/estimate.h"
#include "isp/output/report/report.h"

/// These functions are the only access of the command to stdout and stderr. They do not throw: text that a stream did
/// not accept is lost, which std::ferror() reports. main() turns lost output into an exit code.
namespace lowlux::cli {

/// Returns the text with every control character replaced by a blank, so that no file name can break a line.
std::string one_line(std::string text);

/// Builds text of labelled lines.
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

/// Returns the lines of a table, whose columns are as wide as their widest cell: text, in the first column and from
/// `words_from` on, is aligned at the left, numbers at the right.
std::string aligned_text(const isp::Table& table, std::size_t words_from);

inline void print_text(std::FILE* stream, std::string_view text) { std::fwrite(text.data(), 1, text.size(), stream); }
inline void print_out(std::string_view text) { print_text(stdout, text); }
void print_err(std::string_view text);

/// Collects the text that print_err() is given on this thread, in place of stderr, while it exists.
class ErrorText {
 public:
  ErrorText();
  ~ErrorText();
  ErrorText(const ErrorText&) = delete;
  ErrorText& operator=(const ErrorText&) = delete;
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::string* previous_;
};

/// Names of the pixels of the 2x2 cell, for a table.
inline constexpr std::array site_names = {"site 00", "site 01", "site 10", "site 11"};

/// Holds the two numbers of an estimate as text, for a table.
struct EstimateCells {
  std::string value;
  std::string standard_error;  // empty if there is none
};

/// Returns two digits of the standard error, and as many decimals of the value; without a standard error five digits.
EstimateCells cells_of(const Estimate& estimate);

/// Returns the value and its standard error in one text: "2047.30 +- 0.24".
std::string text_of(const Estimate& estimate);

/// Returns " (did you mean --exposure?)" for a name that is similar to a known one, empty if none is.
std::string suggestion(std::string_view wanted, std::span<const std::string_view> known);

}  // namespace lowlux::cli
