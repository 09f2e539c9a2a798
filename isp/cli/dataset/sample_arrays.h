#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/cli/dataset/array_file.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/cli/simulate/simulate_files.h"

namespace lowlux::cli {

/// Lists the bits of a mask.
inline constexpr unsigned char mask_saturated = 1;  // the code is at the file's white level, or above it
inline constexpr unsigned char mask_hot = 2;        // the pixel is a hot pixel of the sensor's specimen
inline constexpr unsigned char mask_shielded = 4;   // the pixel is in a light-shielded column

/// Returns the mask of a simulated frame: one byte for each pixel of the readout.
Plane<std::uint8_t> mask_of(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor);

/// Writes what a sample has as arrays: masks, and in other formats than DNG raws and truths. With `npy` each array is a
/// file; with `safetensors` they are "raw", "mask", "truth" and "truth_electrons" of one file. Raws and masks are
/// height x width of the readout, those of several frames in one file frames x height x width; truths are height x
/// width x 3. Errors: those of ArrayFile.
class SampleArrays {
 public:
  /// @param files  files of the sample in the format DNG: arrays are named like these
  SampleArrays(SampleFormat format, const SimulateFiles& files, const std::string& stem, bool masks);

  /// Returns the names of all files.
  std::vector<std::string> files() const;

  /// Creates the file of `safetensors`, which has room for frames like this one. Call it once, before the others.
  Result<void> begin(const RawDn& raw, const std::map<std::string, std::string>& metadata);
  /// @param mask  empty: without masks
  Result<void> add_frame(const RawDn& raw, int index, const Plane<std::uint8_t>& mask);
  Result<void> add_truth(const SceneLinear& truth) { return add_picture(truth, "truth", truth_); }
  Result<void> add_electrons(const SceneLinear& electrons) {
    return add_picture(electrons, "truth_electrons", electrons_);
  }
  /// Gives the file of `safetensors` its name. Call it once, after all arrays.
  Result<void> finish();

 private:
  Result<void> add_picture(const SceneLinear& picture, const std::string& name, const std::string& file);
  Result<void> put(const ArrayEntry& array, const std::string& file, std::size_t index,
                   std::span<const std::byte> bytes);

  SampleFormat format_;
  std::string all_;                        // the file of `safetensors`
  std::vector<std::string> raws_, masks_;  // files of `npy`, one for each frame; no masks: empty
  std::string truth_, electrons_;          // likewise; empty: there is none
  std::vector<ArrayEntry> entries_;        // entries of file_
  std::optional<ArrayFile> file_;
};

}  // namespace lowlux::cli
