#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "calib/dark/dark_series.h"
#include "calib/dark/dark_stack.h"
#include "calib/flat/photon_transfer.h"
#include "calib/picture/picture_noise.h"
#include "isp/base/camera_profile.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Standard deviation of the means of rows or columns, and that expected from white noise alone.
struct LineScatter {
  double found_dn = 0;
  double white_dn = 0;
};

/// Results from dark pixels of one exposure time: the pedestal including the dark charge.
struct BlackFigures {
  PerSite<Estimate> level_dn{};    // errors include row and column terms
  PerSite<double> deviation_dn{};  // standard deviation of the pixels that were kept, in one frame
  PerSite<LineScatter> rows{};     // scatter of the mean of the frames
  PerSite<LineScatter> columns{};
  double row_noise_dn = 0;     // common to whole rows of one frame beyond white noise, mean of the sites
  double column_noise_dn = 0;  // fixed
  std::int64_t pixels = 0;     // number kept, of all sites
  double excluded_fraction = 0;
  int frames = 0;
};

/// Measures the means of the pixels within 5 standard deviations (robust estimates) of their site's median: the limits
/// exclude 6e-7 of a normal distribution, equally on both sides. Where the gain is known, pixels up to
/// isp::max_hidden_charge_e above that, in the sum of the frames, are kept: a dark charge of less than an electron is
/// in few pixels.
/// @param gain_dn_per_e  the system gain; 0 where it is not known
/// Errors: those of setting_of; fewer than 500 pixels of a site; more than 5 % excluded; codes at 0 or white.
Result<BlackFigures> measure_black(const RawDn& frame, double gain_dn_per_e = 0);
Result<BlackFigures> measure_black(const DarkGroup& group, double gain_dn_per_e = 0);

/// Returns the frame with a region of its readout as active area: masked pixels to be measured as dark frames are. The
/// region is cropped so that its corner is of the active area's first colour.
/// Errors: a region that is not in the readout; floating-point samples.
Result<RawDn> part_of(const RawDn& frame, const Rect& part);

/// Source of the measurements: files, date and program; the put functions add what was fitted and how well.
struct Measured {
  std::string source;
  std::string date;  // YYYY-MM-DD
  std::vector<std::string> files;
};

/// Returns the gain setting of a frame, as a camera calls it: "ISO 1600", or "" if it states none.
std::string gain_setting_of(const FrameSetting& setting);

/// Writes results from flats and darks into a gain setting's profile. Its values in electrons are converted to the new
/// system gain; a pedestal that was measured on darks stays. A full well that the flats do not reach is replaced by the
/// charge at the white level, and provenance states this, as it does for a read noise below the quantisation.
/// @param darks  setting of the darks
void put_photon_transfer(const PhotonTransfer& transfer, const FrameSetting& darks, const Measured& measured,
                         GainProfile& out);

/// Writes results of a dark series into a gain setting's profile: pedestal, dark current and its temperature law,
/// patterns, hot pixels. Its read noise and full well from flats stay. Without a stated temperature the dark current is
/// stored as that of 20 C, and without a second temperature the doubling figure stays.
void put_dark_series(const DarkSeries& series, std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e,
                     const Measured& measured, GainProfile& out);

/// Writes a black level of one exposure time into a gain setting's profile, dark charge included.
void put_black(const BlackFigures& black, const FrameSetting& setting, const Measured& measured, GainProfile& out);

/// Writes the noise of one ordinary image into a gain setting's profile, and the black point it was measured above
/// unless the pedestal was measured on darks. The read noise includes all noise without light: row noise, and dark
/// charge where the black holds that.
void put_picture_noise(const PictureNoise& noise, const BlackPoint& black, const FrameSetting& setting,
                       const Measured& measured, GainProfile& out);

/// Returns the profile of a gain setting in a camera's profile; a new one if it does not exist.
GainProfile& gain_at(CameraProfile& profile, const FrameSetting& setting);

}  // namespace lowlux::calib
