#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/dataset/sha256.h"

namespace lowlux::cli {

/// Selects the kind of values that a setting has. Even numbers are drawn from ranges whose limits are even.
enum class SettingKind : std::uint8_t { number, whole, even, text };

/// Describes a key of a spec and the option of `lowlux simulate` that it sets.
struct Setting {
  std::string_view key;
  std::string_view flag;
  SettingKind kind;
};

/// Returns all settings.
std::span<const Setting> settings();

/// Describes how a setting is drawn.
struct Distribution {
  enum class Kind : std::uint8_t { choice, uniform, log_uniform };
  Kind kind = Kind::choice;
  std::vector<std::string> choices;  // values as JSON, equally likely; a single one is a constant
  double low = 0, high = 0;          // limits of ranges, low < high
};

/// Holds a setting of a data set and the distribution from which it is drawn.
struct DrawnSetting {
  const Setting* setting = nullptr;
  Distribution distribution;
};

/// Describes a sensor, with the settings that its entry has in place of those of all sensors.
struct DatasetSensor {
  std::string name;
  std::vector<DrawnSetting> settings;
};

/// Describes a file that a spec names.
struct DatasetInput {
  std::string name;  // name in the spec
  FileHash hash;
};

/// Lists the formats of a sample. `dng`: raw files, and truths as OpenEXR; `npy`: a file for each array; `safetensors`:
/// one file.
enum class SampleFormat : std::uint8_t { dng, npy, safetensors };

/// Describes a data set.
struct DatasetSpec {
  std::string folder;  // folder of the spec's file: names of files are relative to it
  std::uint64_t first_index = 0;
  std::uint64_t count = 0;  // first_index + count is at most 2^63
  std::vector<std::string> scenes;
  std::vector<DatasetSensor> sensors;
  bool mask = true;
  bool truth_electrons = false;
  std::optional<SampleFormat> format;  // format that was given; absent: dng
  std::vector<DatasetInput> inputs;
  std::string identity;     // JSON: the spec without first_index and count, and the hashes of its files
  std::string sha256;       // SHA-256 of `identity`: together with an index it determines a sample
  std::string draw_sha256;  // SHA-256 of `identity` without the format, which does not change what is drawn
};

/// Returns whether a scene is generated: any other is an image file.
bool is_generated(const std::string& scene);

/// Returns a file's name as it is opened: relative to the folder of the spec.
std::string path_in(const DatasetSpec& spec, const std::string& file);

/// Reads a spec, and the files it names for their hashes. Errors, with the file and the key: it is not JSON; a key that
/// is missing, unknown or given twice; a value of another type; an empty or reversed range; no choice.
Result<DatasetSpec> read_dataset_spec(const std::string& file);

}  // namespace lowlux::cli
