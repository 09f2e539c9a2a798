#pragma once

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/dataset/dataset_spec.h"

namespace lowlux::cli {

/// Checks before any work what can be checked without making samples: generated scenes, sensors at each of their gain
/// settings, limits and choices of settings. Image files are not decoded. Errors, with the key.
Result<void> check_dataset(const DatasetSpec& spec, Executor& executor);

}  // namespace lowlux::cli
