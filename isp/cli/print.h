#pragma once

#include <cstdio>
#include <string_view>

/// The one way of the command to stdout and stderr. Nothing is thrown: what a stream did not take is lost, and
/// std::ferror() says so. main() turns lost output into an exit code.
namespace lowlux::cli {

inline void print_text(std::FILE* stream, std::string_view text) { std::fwrite(text.data(), 1, text.size(), stream); }
inline void print_out(std::string_view text) { print_text(stdout, text); }
inline void print_err(std::string_view text) { print_text(stderr, text); }

}  // namespace lowlux::cli
