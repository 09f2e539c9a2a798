#pragma once

#include "isp/base/executor.h"

namespace lowlux::test {

/// What tests that are not about threads run on: the calling thread alone, and one more.
inline InlineExecutor one_thread;
inline PoolExecutor two_threads(2);

}  // namespace lowlux::test
