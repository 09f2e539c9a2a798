#pragma once

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/dataset/dataset_spec.h"

namespace lowlux::cli {

/// Checks before any work what can be checked without making samples: generated scenes, sensors with the limits and
/// choices of each setting, the limits of each two settings, and the first 64 draws. Image files are not decoded.
/// Errors, with the key.
Result<void> check_dataset(const DatasetSpec& spec, Executor& executor);

}  // namespace lowlux::cli
