#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// Square windows with sides of 2 r + 1 pixels.
struct ChromaticWindows {
  int chroma_radius = 0;
  int luminance_radius = 0;
};

/// Applies the chromatic filter of Lucchese and Mitra (IEEE TIP 13 (2004) 534-548) with square windows: the
/// chromaticity of a pixel becomes the mean of its window's, each weighted by its stimulus S = X + Y + Z, which is the
/// chromaticity of the window's mean light; its luminance is filtered separately:
///     out = mean(RGB over the one window) / mean(Y over it) * mean(Y over the other)
/// Where the mean luminance of the first window is not positive, there is no chromaticity: neutral. The input light
/// keeps its offset: dark charge desaturates, whatever the window.
/// @param linear  linear Rec. 709, finite
/// @param windows  radii 0 and above; at the borders windows are cut
SceneLinear chromatic_filtered(const RgbView<const float>& linear, const ChromaticWindows& windows);

/// Parameters of other methods, chosen for each light on the tuning set.
struct TunedParameters {
  ChromaticWindows windows;
  std::array<double, 3> stabilised_gain{1, 1, 1};  // gains of gat_denoise
};

/// Input of a method.
struct MethodInput {
  const BenchPicture& picture;
  const DenoiseShot& shot;
  const TunedParameters& tuned;
  const NlMeans* nl_means = nullptr;
  NlMeansStrength strength;  // optimum found by search
  int rounds = 1;            // number of rounds in which times are measured
  int slow_rounds = 1;       // number of rounds of methods that take a second or more for each megapixel
};

/// Result of a method, and the CPU time of the denoising alone on one thread: the median of the rounds, their
/// spread_of(), and the median time of copying the mosaic between rounds.
struct MethodResult {
  RenderedPicture picture;
  double cpu_s = 0;
  double spread = std::numeric_limits<double>::quiet_NaN();
  double memcpy_s = 0;
};

/// Memory that methods have in common, for images up to a given size.
struct MethodMemory {
  MethodMemory(int max_width, int max_height, Executor& for_rendering);
  denoise::Denoiser denoiser;
  BenchRenderer renderer;
};

enum class MethodKind : std::uint8_t { ceiling, other, ours };

/// Describes a row of the stage `denoise`.
struct DenoiseMethod {
  std::string name;
  MethodKind kind = MethodKind::other;
  denoise::Level level = denoise::Level::standard;  // for methods with levels
  Result<MethodResult> (*run)(const MethodInput& input, denoise::Level level, MethodMemory& memory);
};

inline constexpr const char* name_of_none = "none";
inline constexpr const char* name_of_nl_means = "opencv-nlm";

/// Returns all rows of the table, those of this project last.
///     noise-free      the mean of the mosaic: the error left by demosaicing
///     none            dark subtracted, signed
///     dark-left-in    pedestal only; the exposure gives it the mean luminance of the truth
///     chromatic       chromatic_filtered() on dark-left-in
///     opencv-nlm      fastNlMeansDenoisingColored on the codes of `none`; only with nl_means
///     gat-standard    gat_denoise(), level standard
/// The levels of the denoiser with their defaults follow.
std::vector<DenoiseMethod> denoise_methods(bool with_nl_means);

/// Chooses parameters by PSNR, averaged over the images.
TunedParameters tune(const std::vector<BenchPicture>& pictures, const DenoiseLight& light, Executor& executor);

}  // namespace lowlux::isp
