#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "denoise/denoiser.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {

/// Amount of light, and the sensor's dark charge and noise.
struct DenoiseLight {
  double mean_e = 0;        // mean of the signal, over all pixels of the mosaic
  double dark_e = 0;        // mean dark charge of every pixel
  double read_noise_e = 0;  // standard deviation
};

/// Returns "20/200": mean electrons over dark electrons.
std::string name_of(const DenoiseLight& light);

/// White balance gains of the camera, which is RGGB.
inline constexpr std::array<double, 3> bench_white_gain{2, 1, 1.5};

/// One image, captured once. All methods start from `raw_e`.
struct DenoiseShot {
  DenoiseLight light;
  double white_e = 0;      // charge of a green pixel at display white, the scale of all renderings
  Plane<float> signal_e;   // mean
  Plane<float> raw_e;      // Poisson(signal + dark) + normal read noise; no pedestal, dark still in
  bool saturates = false;  // charge above white_e, dark not counted, is lost; light above white is possible

  denoise::RawNoise noise() const;
};

/// Returns a seed for each image in each light. It depends on the image's index among all, so that a capture does not
/// depend on the set with which the image is read.
std::uint64_t seed_of(const BenchPicture& picture, const DenoiseLight& light);

/// Captures an image. A site (x, y) of colour c receives linear_c * white_e / gain_c, with white_e such that the mean
/// over the mosaic is light.mean_e. Equal input gives an equal shot.
/// @param picture  not black; at most poisson_max_mean electrons anywhere
/// @param saturates  each site holds white_e and no more; light.mean_e is then the mean of light limited to 1
DenoiseShot take(const BenchPicture& picture, const DenoiseLight& light, std::uint64_t seed, bool saturates = false);

/// How much of a shot's noise a mosaic contains.
enum class NoiseLeft { none, reduced, all };

/// Returns a mosaic [e-] in the renderer's form: gains that scale white_e to 1 and make white neutral, and parameters
/// of demosaicing as the pipeline chooses them for the noise.
/// @param exposure  1 maps white_e to display white
SignedMosaic mosaic_of(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, NoiseLeft left,
                       DemosaicMethod method, double exposure = 1);

/// Returns the value at which the renderer clips: that of green's saturation, or infinity.
float clip_of(const DenoiseShot& shot, double exposure = 1);

/// Renders mosaics by the same rules for all methods: gains, the demosaicing that the pipeline would choose (see
/// `plan_demosaic`), an exposure that undoes the light.
class BenchRenderer {
 public:
  BenchRenderer(int max_width, Executor& executor);

  /// Renders a mosaic.
  /// @param mosaic_e  signed, as large as the shot's
  /// @param exposure  1 maps white_e to display white
  RenderedPicture render(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, NoiseLeft left,
                         double exposure = 1);
  /// Returns display values of signed linear Rec. 709: colours outside 0..1 move to the neutral of their luminance.
  SceneLinear display_of(const SceneLinear& light);

 private:
  Executor& executor_;
  RawToRgb kernel_;
};

/// Returns the exposure that gives an image that includes its dark the mean luminance of the image without, both of
/// which are known: mean Y / (mean Y + Y of the dark).
double exposure_with_dark(const BenchPicture& picture, const DenoiseShot& shot);

}  // namespace lowlux::isp
