#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/camera_profile.h"
#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Holds a camera's figures at one setting, in codes of the stream.
struct StageSensor {
  double gain_dn_per_e = 0;
  double read_noise_dn = 0;
  PerSite<double> dark_e{};  // mean charge at the frame's exposure and temperature
  std::optional<PerSite<double>> pedestal_dn;
  bool dark_is_apart = true;  // the pedestal does not include dark charge
};

/// Prepares a profile for frames that arrive too fast for a full look-up: the gain settings on a grid of ISO speeds,
/// 100 for an analogue gain of 1, four for each octave.
class StageProfile {
 public:
  /// Reads or takes a profile. Errors: those of the profile's reader; a profile of another kind of sensor
  /// (invalid_argument).
  static Result<StageProfile> read(const std::string& file);
  static Result<StageProfile> of(CameraProfile profile);

  /// Converts the profile for a stream: codes of `format`, sites of its active area.
  Result<void> prepare(const RawFormat& format, BayerPhase phase);

  /// Returns the figures for one frame. Allocates nothing. Gain and read noise are interpolated linearly in log-log
  /// between the profile's settings.
  /// @param analogue_gain, exposure_s, temperature_c  if not known: the profile's only setting, else gain 1; no dark
  ///     charge; the temperature of the profile's darks
  /// @return nullopt if the profile has no gain settings with a known system gain
  std::optional<StageSensor> at(std::optional<double> analogue_gain, std::optional<double> exposure_s,
                                std::optional<double> temperature_c) const;

  const CameraProfile& profile() const { return profile_; }
  std::vector<ColourCalibration> calibrations() const;
  /// Returns the pixels that exceed the others by six read noises in a frame of a 25th of a second, ascending.
  std::vector<HotPixelFigure> hot_pixels() const;

 private:
  struct Row {
    double iso = 0;
    double gain_dn_per_e = 0;
    double read_noise_e = 0;
    std::array<double, 3> dark_current_e_per_s{};
    double dark_temperature_c = 20;
    double dark_doubling_c = 7;
    double codes = 1;  // codes of the stream per code of the profile
    std::optional<PerSite<double>> pedestal_dn;
    bool dark_is_apart = true;
  };
  CameraProfile profile_;
  std::vector<Row> rows_;  // by rising ISO
  RawFormat format_;
  BayerPhase phase_ = BayerPhase::rggb;
};

}  // namespace lowlux::isp
