#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "isp/base/result.h"
#include "isp/cli/dataset/dataset_args.h"
#include "isp/cli/dataset/dataset_sample.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/output/atomic_file.h"

namespace lowlux::cli {

/// Returns the number of samples of a shard, and the index of one of them, 0 being the first.
std::uint64_t samples_in(const DatasetSpec& spec, const Shard& shard);
std::uint64_t index_in(const DatasetSpec& spec, const Shard& shard, std::uint64_t sample);

/// Writes dataset.json, which states the spec, the hashes of its files and the version, or checks one that exists. It
/// does not depend on the shard and the count, so that more samples can be added later. Errors: the folder holds
/// samples of another spec or version, and `force` is not given; those of AtomicFile.
Result<void> claim_folder(const DatasetSpec& spec, const std::string& folder, bool force);

/// Writes manifest-I-of-N.json: the files of each sample of a shard with their sizes and SHA-256. Samples go to the
/// disk as they are added, so that memory does not grow with their number.
class Manifest {
 public:
  /// Errors: those of AtomicFile.
  static Result<Manifest> create(const DatasetSpec& spec, const Shard& shard, const std::string& folder);
  Result<void> add(std::uint64_t index, const DatasetSample& sample);
  /// Gives the file its name. Call it once, after all samples.
  Result<void> commit();

 private:
  Manifest(isp::AtomicFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  Result<void> write(std::string_view text);

  isp::AtomicFile file_;
  std::string name_;
  bool first_ = true;
};

}  // namespace lowlux::cli
