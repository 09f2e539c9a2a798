#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {

/// Amount of light of a simulated raw frame, and the sensor's dark charge and noise.
struct DevelopLight {
  std::string name;
  double mean_e = 0;        // mean of the signal, over all pixels of the mosaic
  double dark_e = 0;        // mean dark charge of every pixel
  double read_noise_e = 0;  // standard deviation
  double gain_dn_per_e = 0;
  double scene_cd_m2 = 0;  // mean luminance that is passed to the look of the eye
};

/// Returns the lights 2000 e-, 20 e-, and 4 e- over 200 e- of dark; quick: 20 e- alone.
std::vector<DevelopLight> develop_lights(bool quick);

/// Holds a scene as a 14-bit sensor records it: photon noise, dark charge, read noise, fixed patterns, hot pixels,
/// noise of rows and columns; masked columns at the left measure pedestal and dark. The mean has none of these, and the
/// truth all three colours of each pixel.
struct SimulatedRaws {
  RawFrame noisy;
  RawFrame mean;   // signal alone, in finer codes
  RawFrame truth;  // signal alone, demosaiced, in 16 bits
};

/// Simulates an image in front of a Nikon D5100's filters (capture/synthetic). Equal input gives equal frames.
/// Errors: those of the simulation.
Result<SimulatedRaws> simulated_raws(const BenchPicture& picture, const DevelopLight& light, std::uint64_t seed,
                                     Executor& executor);

/// Returns the exact black level of a noisy frame, pedestal and mean dark charge [DN].
double true_black_dn(const RawFrame& noisy, const DevelopLight& light);

/// Returns the exposure [EV] that gives a noisy frame the brightness of the mean at `exposure_ev`. Exposures are
/// relative to the range between black and white, which dark charge in the black level reduces.
double noisy_exposure_ev(const RawFrame& noisy, const DevelopLight& light, double exposure_ev);

/// Returns a frame of another size: its active area repeated, and cropped. It has no masked pixels; even sizes stay in
/// phase.
/// @param frame  a mosaic whose active area has even sides
RawFrame tiled(const RawFrame& frame, int width, int height);

}  // namespace lowlux::isp
