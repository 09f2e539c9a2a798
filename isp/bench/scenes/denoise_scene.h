#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "denoise/denoiser.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/reproduce/bench_picture.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {

/// How much light, and what the sensor adds to it.
struct DenoiseLight {
  double mean_e = 0;        // of the signal, over all pixels of the mosaic
  double dark_e = 0;        // mean dark charge of every pixel
  double read_noise_e = 0;  // standard deviation
};

/// "20/200": mean electrons over dark electrons.
std::string name_of(const DenoiseLight& light);

/// The camera: RGGB, and gains that make white neutral.
inline constexpr std::array<double, 3> bench_white_gain{2, 1, 1.5};

/// One picture, taken once. All methods start from `raw_e`.
struct DenoiseShot {
  DenoiseLight light;
  double white_e = 0;     // charge of a green pixel at display white, the scale of all renderings
  Plane<float> signal_e;  // mean
  Plane<float> raw_e;     // Poisson(signal + dark) + normal read noise; no pedestal, dark still in

  denoise::RawNoise noise() const;
};

/// A seed for each picture in each light. Of the picture's place among all, so that it is taken the same way whatever
/// set it is read with.
std::uint64_t seed_of(const BenchPicture& picture, const DenoiseLight& light);

/// Takes it. A site (x, y) of colour c receives linear_c * white_e / gain_c, with white_e such that the mean over the
/// mosaic is light.mean_e. Equal input, equal shot.
/// @param picture  not black; at most poisson_max_mean electrons anywhere
DenoiseShot take(const BenchPicture& picture, const DenoiseLight& light, std::uint64_t seed);

/// A mosaic [e-] as the renderer takes it: gains that bring white_e to 1 and make white neutral.
/// @param exposure  1 brings white_e to display white
SignedMosaic mosaic_of(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, double exposure = 1);

/// Mosaics to pictures, for all methods alike: gains, Malvar-He-Cutler demosaicing, exposure that undoes the light.
class BenchRenderer {
 public:
  BenchRenderer(int max_width, Executor& executor);

  /// @param mosaic_e  signed, as large as the shot's
  /// @param exposure  1 brings white_e to display white
  RenderedPicture render(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, double exposure = 1);
  /// Display values of signed linear Rec. 709: colours outside of 0..1 go to the neutral of their luminance.
  SceneLinear display_of(const SceneLinear& light);

 private:
  Executor& executor_;
  RawToRgb kernel_;
};

/// Exposure that gives a picture with its dark still in the mean luminance of the picture without, which both are
/// known: mean Y / (mean Y + Y of the dark).
double exposure_with_dark(const BenchPicture& picture, const DenoiseShot& shot);

}  // namespace lowlux::isp
