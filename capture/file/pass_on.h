#pragma once

#include <utility>

#include "isp/base/result.h"

namespace lowlux::capture {

/// Converts the failure of one result to that of another: `if (!size) return pass_on(size);`
template <class T>
tl::unexpected<Error> pass_on(Result<T>& failed) {
  return tl::make_unexpected(std::move(failed.error()));
}

}  // namespace lowlux::capture
