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

/// Standard deviation of the means of rows or columns, and what white noise alone would give.
struct LineScatter {
  double found_dn = 0;
  double white_dn = 0;
};

/// What dark pixels of one exposure time say: the pedestal with the dark charge in it.
struct BlackFigures {
  PerSite<Estimate> level_dn{};    // row and column terms are in the errors
  PerSite<double> deviation_dn{};  // of the pixels that were kept, in one frame
  PerSite<LineScatter> rows{};     // of the mean of the frames
  PerSite<LineScatter> columns{};
  double row_noise_dn = 0;     // what whole rows of one frame have in common beyond white noise, mean of the sites
  double column_noise_dn = 0;  // fixed
  std::int64_t pixels = 0;     // kept, of all sites
  double excluded_share = 0;
  int frames = 0;
};

/// Means of the pixels within 5 standard deviations (robustly found) of their site's median: the cut takes 6e-7 of a
/// normal law on both sides alike.
/// Errors: those of setting_of; fewer than 500 pixels of a site; more than 5 % excluded; codes at 0 or white.
Result<BlackFigures> measure_black(const RawDn& frame);
Result<BlackFigures> measure_black(const DarkGroup& group);

/// The frame with one part of its readout as active area: masked pixels to be measured as dark frames are. The part is
/// cut so that its corner is of the active area's first colour.
/// Errors: a part that is not in the readout.
Result<RawDn> part_of(const RawDn& frame, const Rect& part);

/// Where the figures come from: files, date and program; the functions below add what was fitted and how well.
struct Measured {
  std::string source;
  std::string date;  // YYYY-MM-DD
  std::vector<std::string> files;
};

/// The gain setting of a frame, as a camera calls it: "ISO 1600", or "" if it states none.
std::string gain_setting_of(const FrameSetting& setting);

/// Puts what flats and darks say into a gain setting's profile. What it has in electrons is counted anew with the new
/// system gain; a pedestal that was measured on darks stays. A full well that the flats do not reach is taken as the
/// charge at the white level, and provenance says so; so is a read noise that is lost in the codes.
/// @param darks  setting of the darks
void put_photon_transfer(const PhotonTransfer& transfer, const FrameSetting& darks, const Measured& measured,
                         GainProfile& out);

/// Puts what a dark series says into it: pedestal, dark current and its temperature law, patterns, hot pixels. A read
/// noise and a full well that it has from flats stay. Without a stated temperature the dark current is said to be that
/// of 20 C, and without a second temperature the doubling figure stays what it was.
void put_dark_series(const DarkSeries& series, std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e,
                     const Measured& measured, GainProfile& out);

/// Puts a black level of one exposure time into it, dark charge included.
void put_black(const BlackFigures& black, const FrameSetting& setting, const Measured& measured, GainProfile& out);

/// Puts the noise of one ordinary picture into it, and the black point it was measured above unless the pedestal was
/// measured on darks. The read noise holds all that is there without light: row noise, and dark charge where the black
/// holds that.
void put_picture_noise(const PictureNoise& noise, const BlackPoint& black, const FrameSetting& setting,
                       const Measured& measured, GainProfile& out);

/// The profile of a gain setting in a camera's profile; a new one if there is none yet.
GainProfile& gain_at(CameraProfile& profile, const FrameSetting& setting);

}  // namespace lowlux::calib
