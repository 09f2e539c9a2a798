#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {

/// How much light a simulated raw frame has got, and what its sensor adds.
struct DevelopLight {
  std::string name;
  double mean_e = 0;        // of the signal, over all pixels of the mosaic
  double dark_e = 0;        // mean dark charge of every pixel
  double read_noise_e = 0;  // standard deviation
  double gain_dn_per_e = 0;
  double scene_cd_m2 = 0;  // mean luminance that the look of the eye is told of
};

/// 2000 e-, 20 e-, and 4 e- over 200 e- of dark; quick: 20 e- alone.
std::vector<DevelopLight> develop_lights(bool quick);

/// A scene as a sensor of 14 bits gives it: photon noise, dark charge, read noise, fixed patterns, hot pixels, noise of
/// rows and columns; masked columns at the left tell pedestal and dark. And the same without any of these.
struct SimulatedRaws {
  RawFrame noisy;
  RawFrame mean;  // signal alone, in finer codes
};

/// A picture in front of a Nikon D5100's filters (capture/synthetic). Equal input, equal frames.
/// Errors: those of the simulation.
Result<SimulatedRaws> simulated_raws(const BenchPicture& picture, const DevelopLight& light, std::uint64_t seed,
                                     Executor& executor);

/// A frame of another size: its active area repeated, and cut off. Without masked pixels; even sizes stay in phase.
/// @param frame  a mosaic whose active area has even sides
RawFrame tiled(const RawFrame& frame, int width, int height);

}  // namespace lowlux::isp
