#pragma once

#include <exception>
#include <string>
#include <utility>

#include "isp/base/result.h"

/// Errors of lowlux as exceptions, which become those of lowlux/errors.py in Python.
namespace lowlux::python {

/// Carries an Error to Python. It is the only exception that isp/python throws on purpose.
class Failure : public std::exception {
 public:
  explicit Failure(Error error) : error_(std::move(error)) {}
  const char* what() const noexcept override { return error_.message.c_str(); }
  const Error& error() const { return error_; }

 private:
  Error error_;
};

/// Returns the value of a result. Throws Failure if it is an error.
template <class T>
T value_of(Result<T>&& result) {
  if (!result) throw Failure(std::move(result.error()));
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// Makes Failure the Python exception for its ErrorCode, with the message that the command prints, and std::bad_alloc
/// that of ErrorCode::too_large.
void register_failures();

}  // namespace lowlux::python
