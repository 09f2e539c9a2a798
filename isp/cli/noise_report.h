#pragma once

#include <span>

#include "calib/pair_statistics.h"
#include "calib/photon_transfer.h"
#include "isp/cli/calibration.h"

namespace lowlux::cli {

/// Adds a photon transfer to a calibration's text and report: figures, the curve and its residuals.
void show_photon_transfer(const calib::PhotonTransfer& transfer, std::span<const calib::PairStatistics> darks,
                          std::span<const calib::PairStatistics> flats, Calibration& found);

}  // namespace lowlux::cli
