#pragma once

#include <iterator>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace lowlux::cli {

/// Text of labelled lines.
class Lines {
 public:
  template <class... T>
  void add(const char* label, fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(text_), "  {:<15}", label);
    fmt::format_to(std::back_inserter(text_), format, std::forward<T>(values)...);
    text_ += '\n';
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace lowlux::cli
