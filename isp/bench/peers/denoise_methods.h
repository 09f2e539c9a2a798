#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/peers/chromatic_filter.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// Parameters of other methods, chosen for each light on the tuning set.
struct TunedParameters {
  ChromaticWindows windows;
  std::array<double, 3> stabilised_gain{1, 1, 1};  // of gat_denoise
};

/// Input of a method.
struct MethodInput {
  const BenchPicture& picture;
  const DenoiseShot& shot;
  const TunedParameters& tuned;
  const NlMeans* nl_means = nullptr;
  NlMeansStrength strength;  // optimum found by search
  int rounds = 1;            // of timing
  int slow_rounds = 1;       // of methods that take a second or more for each megapixel
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
