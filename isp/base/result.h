#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace lowlux {

/// Lists the kinds of failures outside of lowlux. Programming errors are assertions, not errors.
enum class ErrorCode {
  not_found,         // no such file or device
  unreadable,        // it exists and cannot be read
  malformed,         // it contradicts its format or itself
  unsupported,       // it is well formed, and lowlux does not handle it
  too_large,         // it would take more memory than the limit
  exists,            // an output already exists
  unwritable,        // an output cannot be written
  invalid_argument,  // an option or parameter outside its range
  insufficient,      // too little in the data to answer without guessing
};

/// Describes one failure: what is wrong and what would help, in one line without a final full stop.
struct Error {
  ErrorCode code;
  std::string message;
  std::string where;  // the file, option or tag concerned; may be empty
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(ErrorCode code, std::string message, std::string where = {}) {
  return tl::make_unexpected(Error{code, std::move(message), std::move(where)});
}

}  // namespace lowlux
