#pragma once

#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Runs `info --advise`: prints the advice and writes its page. @return the exit code
int run_advise(const InfoArgs& args);

}  // namespace lowlux::cli
