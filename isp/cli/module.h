#pragma once

#include <string>

#include "isp/base/result.h"

namespace lowlux::cli {

/// A part of the command that is loaded only by what needs it, because of the libraries that come with it.
struct Module {
  std::string file;      // liblowlux_....so
  std::string function;  // exported by it, extern "C"
  std::string purpose;   // "finding charts"
  std::string needs;     // "OpenCV's mcc module (Debian: ...)"
};

/// The address of its function. The module is looked for in the command's folder, then in the installation's library
/// folder; it stays loaded.
/// Errors: unreadable, with what the loader says (a library is not installed, the file is missing), or that the module
/// is of another build: it carries the version and a hash of all headers, the compiler and its flags, which must be
/// those of the command.
Result<void*> load_module(const Module& module);

}  // namespace lowlux::cli
