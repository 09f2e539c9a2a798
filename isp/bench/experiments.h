#pragma once

#include "isp/bench/reproduce.h"

namespace lowlux::isp {

/// The experiments of the registry, one file each; the claims are in their findings.
Result<Outcome> run_few_photons(const RunOptions& options);
Result<Outcome> run_chromaticity_clouds(const RunOptions& options);
Result<Outcome> run_frequency_of_seeing(const RunOptions& options);
Result<Outcome> run_sensor_scenarios(const RunOptions& options);
Result<Outcome> run_dark_desaturation(const RunOptions& options);
Result<Outcome> run_snr_sensitivity(const RunOptions& options);
Result<Outcome> run_mesopic_tracks(const RunOptions& options);
Result<Outcome> run_mesopic_fixed_gamma(const RunOptions& options);
Result<Outcome> run_retargeting(const RunOptions& options);

}  // namespace lowlux::isp
