#pragma once

#include <optional>

#include "denoise/patch_estimate.h"
#include "isp/model/colorimetry.h"

namespace lowlux::denoise {

/// A chromaticity with the bias of ratios taken off.
struct DebiasedChroma {
  isp::UvPrime uv;
  double weight_snr = 0;  // W / std(W) as measured; below 4 report a prior, not this (Fieller: no bounded interval)
};

/// For unbiased N and W, E[N / W] - u ~ (u Var(W) - Cov(N, W)) / W^2, which does not average out over patches. Off goes
/// its plug-in estimate,
///     u' - (u' Var(W) - Cov(N_u, W)) / max(W, 3 std(W))^2,  v' likewise.
/// 75 % and more of the bias go for W / std(W) >= 5.
/// @return nullopt unless W > 0 and all is finite
std::optional<DebiasedChroma> debiased_chroma(const XyzEstimate& estimate);

}  // namespace lowlux::denoise
