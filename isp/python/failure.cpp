#include "isp/python/failure.h"

#include <new>
#include <string_view>

#include <pybind11/pybind11.h>

#include "isp/cli/shared/report.h"
#include "isp/python/text.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

const char* name_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::not_found:
      return "NotFoundError";
    case ErrorCode::unreadable:
      return "UnreadableError";
    case ErrorCode::malformed:
      return "MalformedError";
    case ErrorCode::unsupported:
      return "UnsupportedError";
    case ErrorCode::too_large:
      return "TooLargeError";
    case ErrorCode::exists:
      return "ExistsError";
    case ErrorCode::unwritable:
      return "UnwritableError";
    case ErrorCode::invalid_argument:
      return "ArgumentError";
    case ErrorCode::insufficient:
      break;
  }
  return "InsufficientError";
}

/// Returns the line that the command prints, without its name in front and without options of the command.
std::string message_of(const Error& error) {
  if (error.message.find("--force") != std::string::npos) return error.where + " exists: overwrite=True replaces it";
  if (error.where.empty()) return error.message;
  constexpr std::string_view program = "lowlux: ";
  return cli::error_line(error.where, error).substr(program.size());
}

void set_python_error(const Error& error) {
  const py::object type = py::module_::import("lowlux.errors").attr(name_of(error.code));
  const py::object raised = type(str_of(message_of(error)), str_of(error.where));
  PyErr_SetObject(type.ptr(), raised.ptr());
}

}  // namespace

void register_failures() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Failure& failure) {
      set_python_error(failure.error());
    } catch (const std::bad_alloc&) {
      set_python_error({ErrorCode::too_large, "not enough memory", {}});
    }
  });
}

}  // namespace lowlux::python
