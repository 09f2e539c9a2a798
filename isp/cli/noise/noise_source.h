#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/noise/noise_figures.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/noise/noise_origin.h"
#include "isp/pipeline/options.h"

namespace lowlux::cli {

/// Returns the files in which darktable may have installed its table of noise, in the order in which they are tried:
/// darktable/noiseprofiles.json in the folders of XDG_DATA_DIRS (/usr/local/share and /usr/share where it is not set),
/// then those of /opt/darktable and of Flatpak.
std::vector<std::string> darktable_files();

/// Returns what is known of the noise of a frame's sensor without measuring it: darktable's figures of the camera, else
/// those of libcamera for a sensor of Raspberry Pi, else those of the class of the sensor. The first two need an ISO.
/// A table of darktable's that cannot be read adds a warning, and is not used.
/// @param range_dn  white less black, above 0
NoiseOrigin known_noise(const RawDn& raw, double range_dn, std::vector<std::string>& warnings);

/// Reads the argument of --noise, "GAIN,READ": DN per electron and electrons rms.
/// @return nullopt: not two numbers, or not within 1e-6 to 1e6 DN/e- and 0 to 1e5 e-
std::optional<calib::NoiseFigures> noise_figures_of(const std::string& text);

/// Sets the noise model of a frame: the figures given, else those of a profile or of the file that are in the frame
/// already, else those measured on the image, else those known of the sensor (known_noise), adjusted to the image as
/// far as it shows them, and never above the noise that it has: where that is less and not white, the raw was denoised
/// before, which is noted as NoiseProfile::reduced. A warning states the last three, and a measurement that is
/// uncertain. Where noise is not to be reduced, and for frames that are not Bayer mosaics, nothing is measured or
/// assumed. Frames of floating-point samples are not those of a sensor: their noise is given, stated, or left as it is
/// with a warning.
/// @return where the noise comes from; nullopt: the frame is unchanged
/// Errors: those of the black point; figures given that are not possible for the frame; unknown noise of floats where
/// noise has to be reduced (a level was requested, or DenoiseChoice::always).
Result<std::optional<NoiseOrigin>> find_noise(const isp::DevelopOptions& options,
                                              const std::optional<calib::NoiseFigures>& given, RawFrame& frame,
                                              Executor& executor);

}  // namespace lowlux::cli
