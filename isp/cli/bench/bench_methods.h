#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/bench/methods/method.h"

namespace lowlux::cli {

/// Methods that a command line asks for, and ready ones among them that are not installed.
struct RequestedMethods {
  std::vector<isp::ScoredMethod> methods;
  std::vector<Error> not_installed;
};

/// Returns the levels of `lowlux denoise` as methods, run by this command. Error: /proc is not mounted.
Result<std::vector<isp::ScoredMethod>> own_methods();

/// Makes methods of the texts of --method. Error: one is not valid, or two have one name.
Result<RequestedMethods> requested_methods(const std::vector<std::string>& texts);

/// Returns an Error unless all names differ.
Result<void> check_method_names(const std::vector<isp::ScoredMethod>& methods);

}  // namespace lowlux::cli
