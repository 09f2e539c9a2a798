#pragma once

#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "denoise/denoiser.h"
#include "isp/base/plane.h"
#include "tests/denoise/frames.h"
#include "tests/hard_cases/hard_case.h"

/// One raw mosaic through every path that reduces noise.
namespace lowlux::hard_cases {

/// A mosaic in electrons, dark charge in, and what is known of it.
struct MosaicCase {
  Plane<float> raw_e;
  BayerPhase phase = BayerPhase::rggb;
  denoise::RawNoise noise;
  denoise::DenoiseOptions options;  // the level is chosen by the path
  double gain_dn_per_e = 4;         // of the codes that files and cameras hold it in
  double black_dn = 512;            // dark charge not in it

  MosaicCase with_values(Plane<float> other_e) const {
    return {std::move(other_e), phase, noise, options, gain_dn_per_e, black_dn};
  }
};

/// A frame of a scene.
MosaicCase case_of(const denoise_testing::Camera& camera, const denoise_testing::Scene& scene, int width, int height,
                   std::uint64_t seed);

/// Signal electrons that a path makes of it.
Plane<double> by_reference(const MosaicCase& c, denoise::Level level, Denormals mode);
Plane<double> by_denoiser(const MosaicCase& c, denoise::Level level, Denormals mode, int threads = 2);
/// As codes of 14 bits, through the pipeline; the picture is rendered too, and must hold numbers only.
Plane<double> by_file(const MosaicCase& c, Denormals mode, int threads = 2);
/// The same through LivePipeline, whose mosaics are codes of 16 bits.
Plane<double> by_live(const MosaicCase& c, Denormals mode, int threads = 2);

/// Frames one after another through LivePipeline, where frames before take part and levels do not.
class LiveMeans {
 public:
  /// @param first  for frames of its size and sensor
  LiveMeans(const MosaicCase& first, Denormals mode);
  ~LiveMeans();
  LiveMeans(const LiveMeans&) = delete;
  LiveMeans& operator=(const LiveMeans&) = delete;
  /// Signal electrons. @param light  exposure time over that of the frame before
  Plane<double> take(const MosaicCase& c, double light);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Whether the plan of a file with this mosaic warns of something, by a word.
bool warns_of(const MosaicCase& c, Denormals mode, std::string_view word);

/// What a path makes of a mosaic.
using PathRun = std::function<Plane<double>(const MosaicCase&)>;

struct MosaicBounds {
  Bound reference;
  Bound fast;  // of levels and instruction sets
  Bound file;
  Bound live;
};

/// Roundings of 600 operations, which a value goes through, add up like noise: 2^-53 or 2^-24 times the root of their
/// number, of the largest value.
inline constexpr Bound double_sums{24.5 * 0x1p-53, rounding}, float_sums{24.5 * 0x1p-24, rounding};

/// Every column but those whose bound is negative, which the caller fills. Reference and instruction sets go by
/// `standard`.
/// @param error  of what a path gives for one mosaic or several
void measure(HardCase& row, const MosaicBounds& bounds, const std::function<double(const PathRun&)>& error);

using MosaicError = std::function<double(PlaneView<const double> signal_e)>;
void measure(HardCase& row, const MosaicCase& c, const MosaicBounds& bounds, const MosaicError& error);

/// Largest change of the mean of a colour, in standard errors of the noise of its sites.
MosaicError change_of_means(const MosaicCase& c);
/// Largest difference from one value.
MosaicError distance_from(double value_e);
/// Largest difference of two results [e-].
double largest_difference(const Plane<double>& a, const Plane<double>& b);

}  // namespace lowlux::hard_cases
