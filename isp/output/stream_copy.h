#pragma once

#include <cstdio>
#include <functional>

#include "isp/base/result.h"

namespace lowlux::isp {

/// Writes a file completely to a file descriptor that cannot be moved in, such as a pipe: `encode` writes it to an
/// unnamed temporary file first, so that nothing is written if that fails. The descriptor stays open. SIGPIPE must be
/// ignored.
/// Errors: those of `encode`; there is no room for the temporary file; the descriptor is not written to, as a pipe
/// whose reader has ended.
Result<void> write_to_stream(int descriptor, const std::function<Result<void>(std::FILE* file)>& encode);

}  // namespace lowlux::isp
