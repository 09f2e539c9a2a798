#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "isp/base/result.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Holds the draws of one sample: scene, sensor, the settings by their keys, and the seeds of noise and fixed pattern.
struct DatasetDraw {
  std::string scene;
  const DatasetSensor* sensor = nullptr;
  std::map<std::string, std::string> settings;  // values as JSON
};

/// Returns the 64 random bits of one quantity of a sample: Philox4x32-10 with the first 64 bits of draw_sha256 as its
/// key and (index, quantity) as its counter.
std::uint64_t draw_bits(const DatasetSpec& spec, std::uint64_t index, std::string_view quantity);

/// Returns a value, as JSON, of a distribution for 64 random bits. Values of ranges are rounded to six digits, so that
/// they do not depend on the last bit of the machine's logarithm; those of whole and even numbers include both limits.
std::string draw_value(const Distribution& distribution, SettingKind kind, std::uint64_t bits);

/// Draws the sample of an index: a function of draw_sha256 and the index alone.
DatasetDraw draw_sample(const DatasetSpec& spec, std::uint64_t index);

/// Returns the arguments of `simulate` for a draw, without outputs. Errors, with the key: those of the options.
Result<SimulateArgs> simulate_args(const DatasetSpec& spec, const DatasetDraw& draw);

/// Returns a message with the keys of a spec in place of the options of `simulate`.
std::string in_keys(std::string message);

}  // namespace lowlux::cli
