#pragma once

#include <array>
#include <optional>

#include "isp/base/frame.h"
#include "isp/base/spectrum.h"
#include "isp/pipeline/live/live_plan.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/raw_frames.h"
#include "tests/support/synthetic_camera.h"

/// Frames of the synthetic camera, in either mode, and what pipelines take.
namespace lowlux::hard_cases {

/// An even field in front of the plain sensor of tests/support/synthetic_camera.h, with 1 DN/e- and a full well of
/// 15000 e-; black at 512.
struct Simulated {
  double luminance_cd_m2 = 0;
  std::optional<double> green_e;  // set: the luminance is what gives green so many
  double time_s = 1;
  double temperature_c = 20;
  double dark_e_per_s = 0;          // at 20 C; it doubles every 7
  const Spectrum* light = nullptr;  // absent: D65
  bool clips = true;
  int width = 64;
  int height = 64;
};

RawFrame simulated(const Simulated& how, Denormals mode);
/// Why there is no such frame; nullopt if there is.
std::optional<Error> refusal_of(const Simulated& how, Denormals mode);

/// How far the mean of the green pixels is from photons and dark current summed by hand, in its standard errors, whose
/// variance is the closed form's.
double error_of_green(const Simulated& how, Denormals mode);

/// What isp::saturated_channels says of a frame exposed to a share of what saturates green.
std::array<bool, 3> saturated_flags(double gain_dn_per_e, double share, Denormals mode);

/// Whether LivePipeline takes a stream with this setup (format and size are filled in) and plans a frame of it.
bool live_takes(isp::LiveSetup setup, const isp::LiveFacts& facts, Denormals mode);

/// Chromaticity of a flat picture that went through denoise::resaturate, the neutral being that of equal energy.
isp::Xy resaturated_flat(const std::array<float, 3>& xyz, const isp::Xyz& dark, double chroma_noise, Denormals mode);

}  // namespace lowlux::hard_cases
