#pragma once

#include <cstdio>
#include <string_view>
#include <utility>

#include <fmt/format.h>

/// The one way of the command to stdout and stderr. Nothing is thrown: what a stream did not take is lost, and
/// std::ferror() says so. main() turns lost output into an exit code.
namespace lowlux::cli {

inline void print_text(std::FILE* stream, std::string_view text) { std::fwrite(text.data(), 1, text.size(), stream); }

template <class... T>
void print_out(fmt::format_string<T...> format, T&&... args) {
  print_text(stdout, fmt::format(format, std::forward<T>(args)...));
}

template <class... T>
void print_err(fmt::format_string<T...> format, T&&... args) {
  print_text(stderr, fmt::format(format, std::forward<T>(args)...));
}

}  // namespace lowlux::cli
