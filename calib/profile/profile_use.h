#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/camera_profile.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Returns RGGB, GRBG, GBRG, BGGR, or monochrome; empty for frames that are demosaiced.
std::string mosaic_of(const RawDn& frame);

/// Properties of a camera's profile at the setting of one frame.
struct ProfileAtFrame {
  std::optional<BlackPoint> black;  // at the frame's gain, exposure and temperature, dark charge included; absent if
                                    // not in the profile: then the frame's own applies
  std::optional<PerSite<double>> pedestal_dn;  // `black` without dark charge; absent if not known
  std::optional<SensorModel> sensor;           // at the frame's gain and temperature; absent if the gain is unknown
  PerSite<double> dark_mean_e{};               // dark charge of the frame; 0 if unknown
  std::optional<NoiseProfile> noise;           // noise of the sensor, including that of `dark_mean_e`
  std::vector<DefectRect> hot_pixels;          // pixels with an excess charge above 6 standard deviations in this frame
  std::vector<std::string> warnings;           // extrapolations and assumptions
  std::optional<double> iso;                   // ISO speed of the setting, if known to the profile
};

/// Evaluates the profile at a frame's setting. Gain: between two measured ISO settings gain and read noise follow
/// straight lines in log-log, levels in the logarithm of the ISO; beyond them the gain follows the ISO, with a warning.
/// Exposure: pedestal + K D t. Temperature: the profile's doubling figure. Errors and warnings of the mosaic: one is a
/// mosaic and the other monochrome (error); the phases differ (warning: levels of sites may belong to others). Warnings
/// for exposures and temperatures beyond those of the darks. Errors: another camera; a frame that states no ISO if the
/// profile has several; no exposure time if dark current needs it. A profile without gain settings has no effect on a
/// frame. On a frame of floating-point samples no profile has an effect, except for its colours, with a warning.
/// @param gain_setting  name of a setting of the profile, as for gain_named; empty: chosen by the frame's ISO
Result<ProfileAtFrame> profile_at(const CameraProfile& profile, const RawDn& frame,
                                  const std::string& gain_setting = {});

/// Returns the noise of a frame relative to white minus the subtracted black point. If the black point was measured on
/// masked pixels of the frame, or on dark frames, the dark charge is theirs (isp::masked_variance_dn2), not that of the
/// profile at a temperature that may have been assumed; else it is `found.dark_mean_e`. nullopt if the gain is unknown,
/// or black is not below white.
std::optional<NoiseProfile> noise_above(const BlackPoint& black, const ProfileAtFrame& found, const RawDn& frame);

/// Returns a profile's colour calibrations in the form of a frame: at most two, as in a DNG, for the illuminants of
/// lowest and highest temperature, sorted by temperature.
std::vector<ColourCalibration> calibrations_of(const CameraProfile& profile);

}  // namespace lowlux::calib
