#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isp/base/result.h"
#include "isp/cli/dataset/dataset_spec.h"

namespace lowlux::cli {

/// Holds a sample that is complete on the disk.
struct DatasetSample {
  std::string files;        // JSON: [{"name", "bytes", "sha256"}], the parameters' file last
  std::uint64_t bytes = 0;  // bytes of all files
};

/// Returns the sample of an index if it is complete in a folder: its parameters, which are written last, are those of
/// this spec and version, and the other files have their sizes.
std::optional<DatasetSample> find_sample(const DatasetSpec& spec, std::uint64_t index, const std::string& folder);

/// Makes the sample of an index: raws, truths and masks in the format of the spec, and at last the parameters. Existing
/// files are replaced, and all files that the parameters of an older sample of that index list are removed. Errors:
/// those of scene, sensor and writers; no file of the sample is left then.
Result<DatasetSample> make_sample(const DatasetSpec& spec, std::uint64_t index, const std::string& folder);

}  // namespace lowlux::cli
