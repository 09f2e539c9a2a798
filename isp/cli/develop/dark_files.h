#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/dark/dark_frame.h"
#include "calib/dark/dark_stack.h"
#include "calib/frame_setting.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/mosaic_tiff.h"
#include "isp/cli/shared/outputs.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {

/// Returns an error of the option if an image is itself among the files.
Result<void> check_no_picture(const std::vector<Job>& jobs, const std::vector<std::string>& files, const char* option,
                              const char* kind);

/// Returns the noise model of an image in codes, or nullopt where its gain is not known.
std::optional<calib::DarkNoiseModel> noise_model_of(const RawDn& raw, const NoiseProfile& noise,
                                                    const PerSite<double>& pedestal_dn);

/// Names of the files of dark and bias frames.
struct DarkNames {
  std::vector<std::string> darks;
  std::vector<std::string> bias;
  bool empty() const { return darks.empty() && bias.empty(); }
  std::vector<std::string> all() const;
};

/// Returns the dark and bias frames that the arguments name: see raw_files_of_lists. Errors: those, an image that is
/// itself among them, a black level in addition to them, which they hold already. Bias frames alone may go with a
/// profile, which knows the dark current.
Result<DarkNames> dark_files(const DevelopArgs& args, const std::vector<Job>& jobs);

/// Holds the dark frames of the files as they were read.
struct DarkFiles {
  std::vector<calib::DarkGroup> groups;  // groups of raw files: dark frames, then bias frames
  std::size_t darks = 0;                 // number of groups that are of dark frames
  std::vector<MosaicTiff> masters;       // master darks from TIFF files, which state no setting
};

/// Holds the data of the dark frames of all images, and the last frames that were made. It may be used from any thread.
class DarkSource {
 public:
  /// @param request  values that are the same for all images
  /// @param count    exposures that each file is the mean of; absent: estimated where the noise of the image is known
  DarkSource(DarkFiles files, calib::DarkRequest request, std::optional<int> count)
      : files_(std::move(files)), request_(std::move(request)), count_(count) {}

  /// Returns the dark frame of one image: calib::make_dark_frame, once for all images of the same setting, black tag,
  /// noise and estimated number of exposures; at the level of the image's masked pixels if the frame depends on them.
  /// Errors: those of make_dark_frame, of calib::check_masked_level, whose warning is added to those of the image, and
  /// of calib::check_below_picture; bias frames of more than a tenth of the image's exposure time.
  /// @param black  with bias frames alone: if the black point that it requests holds the dark charge, it is the level
  Result<std::shared_ptr<const DarkFrame>> frame_for(RawFrame& picture, const isp::BlackRequest& black);

 private:
  /// Identifies a dark frame by the values it depends on.
  struct Key {
    calib::FrameSetting setting;
    bool has_masked_pixels;
    std::optional<PerSite<double>> pedestal_dn;
    std::optional<calib::DarkNoiseModel> noise;
    std::vector<double> exposures_per_file;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Made {
    Key key;
    std::shared_ptr<const DarkFrame> frame;
  };
  static constexpr std::size_t max_made = 4;  // exposures of a bracket, and one more

  Result<std::shared_ptr<const DarkFrame>> find_or_make(const RawDn& picture, calib::DarkRequest& request);
  Result<void> adopt_masters(const RawDn& picture, const calib::FrameSetting& setting,
                             const calib::DarkRequest& request);
  /// Returns whether there are bias frames alone.
  bool is_bias() const { return files_.darks == 0 && !files_.groups.empty() && files_.masters.empty(); }
  Result<void> check_bias_times(const RawDn& picture) const;
  void count_exposures(const RawDn& picture, calib::DarkRequest& request) const;

  DarkFiles files_;
  calib::DarkRequest request_;
  std::optional<int> count_;
  std::size_t raw_groups_ = files_.groups.size();  // those after them are of `masters`, for images of master_setting_
  std::optional<calib::FrameSetting> master_setting_;
  std::mutex mutex_;
  std::vector<Made> made_;  // most recently used first
};

/// Reads the files one by one and accumulates raw files. Errors: those of reading, of calib::DarkLibrary, and of the
/// profile that --dark-doubling may name: another camera's, or one without the value.
Result<std::shared_ptr<DarkSource>> read_darks(const DarkNames& names, const DarkArgs& args);

/// Subtracts the dark frame of an image from its X-Trans mosaic, before it is interpolated: dark charge and black level
/// belong to single photosites, whatever their colour. The samples become floating-point numbers of the active area,
/// whose black level is the mean of the dark frame; pixels whose dark value is unknown become defects, and the variance
/// that the dark frame adds is added to a NoiseProfile.
/// @param mosaic  as XTransUse has it
/// @return true: the mosaic is to be interpolated. Errors: those of DarkSource::frame_for and isp::black_of
Result<bool> subtract_from_x_trans(DarkSource& darks, const isp::BlackRequest& black, RawFrame& mosaic);

}  // namespace lowlux::cli
