#pragma once

#include <span>

#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer.h"
#include "calib/picture/picture_noise.h"
#include "isp/base/frame.h"
#include "isp/cli/calibrate/calibration.h"

namespace lowlux::cli {

/// Adds a photon transfer to a calibration's text and report: values, the curve and its residuals.
void show_photon_transfer(const calib::PhotonTransfer& transfer, std::span<const calib::PairStatistics> darks,
                          std::span<const calib::PairStatistics> flats, Calibration& found);

/// Adds the noise of one ordinary image to a calibration's text and report, together with the values in the file.
void show_picture_noise(const calib::PictureNoise& noise, const RawFrame& frame, const BlackPoint& black,
                        Calibration& found);

}  // namespace lowlux::cli
