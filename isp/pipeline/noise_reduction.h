#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoise_options.h"
#include "denoise/lines/line_noise.h"
#include "denoise/temporal/temporal.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Describes the noise reduction that is requested.
struct DenoiseChoice {
  enum class Mode : std::uint8_t {
    off,
    automatic,  // chosen from the frame's signal-to-noise ratio: level_for
    level,
  } mode = Mode::off;
  denoise::Level level = denoise::Level::standard;  // for Mode::level
  bool line_noise = true;                           // also row and column noise where it is significant
  bool maps = false;                                // keep NoiseMaps
  bool always = false;                              // for Mode::automatic: draft at least
  /// No prior on colour (DenoiseOptions::rho), and areas keep their mean (DenoiseOptions::keep_means); errors are
  /// larger.
  bool unbiased_chroma = false;
};

/// Describes noise reduction in which previous frames of the stream take part: see denoise::TemporalMean.
struct TemporalReduction {
  denoise::TemporalOptions options;
  double light =
      1;  // unit of this frame over that of the previous one: exposure time, and the gain where frames measure it
  bool restart = true;  // nothing is known of previous frames
};

/// Lists the levels of the regions of a frame: squares that start at the corner of the active area and cover it.
struct NoiseRegions {
  int size = 0;  // side of a region [px]; a multiple of tile_lattice_px
  int columns = 0;
  int rows = 0;
  std::vector<std::optional<denoise::Level>> level;  // rows x columns; absent: only subtract lines and dark charge
};

/// Holds the level of a frame where it is decided together with everything else: see step_plan.h.
struct DecidedLevel {
  std::optional<denoise::Level> level;
  std::optional<NoiseRegions> regions;  // regions with levels of their own
};

/// Holds the decision on noise reduction: everything that is needed to reduce the noise of one frame. Sites are those
/// of the active area.
struct NoiseReduction {
  std::optional<denoise::Level> level;  // absent: values stay as they are
  std::string reason;                   // for the level or its absence; one line
  std::optional<double> snr;            // ratio of one pixel in the median block, by the noise model
  NoiseProfile::Source source = NoiseProfile::Source::file;
  denoise::RawNoise noise;
  std::shared_ptr<const NoiseRatio> noise_ratio;  // RawFrame::noise_ratio, also where nothing is reduced
  denoise::DenoiseOptions options;
  std::vector<denoise::LineOffsets> lines;  // subtracted before noise reduction
  /// Set where each pixel is a cell of its own (pixel_cells.h): the charge of its sites of R, G, B at white [e-], in
  /// which `noise` is stated.
  std::optional<std::array<double, 3>> cell_e;
  std::array<double, 3> site_part{1, 1, 1};  // charge of a site over that of its pixel
  std::optional<TemporalReduction> temporal;
  std::optional<NoiseRegions> regions;  // set: their levels apply, and `level` does not
  std::vector<std::string> warnings;    // contradictions to the noise model

  /// Returns whether any region of the frame has a level.
  bool has_level() const {
    if (!regions) return level.has_value();
    return std::ranges::any_of(regions->level, [](const auto& of_region) { return of_region.has_value(); });
  }
  bool reduces() const { return has_level() || temporal; }
  /// Returns the variance of a pixel of R, G, B without light, as `noise` states it for sites.
  std::array<double, 3> pixel_variance_e2() const {
    std::array<double, 3> out = noise.variance_e2;
    for (std::size_t c = 0; c < 3; ++c) out[c] /= site_part[c];
    return out;
  }
};

/// Returns the level for the signal-to-noise ratio of one pixel: none from 60 on, where no difference is visible; draft
/// from 20 on, standard from 3 on; high below, where chroma starts coarse, which makes it cheap.
std::optional<denoise::Level> level_for(double snr);

/// Holds what is known of the residual noise, for each 2x2 cell of the image: see denoise::DenoiseMaps. Where a region
/// keeps its noise, that is the residual noise, averaged over 8 x 8 cells, and colour is unchanged: its confidence is
/// 1.
struct NoiseMaps {
  Plane<float> residual_variance_e2;
  Plane<float> chroma_confidence;
  std::array<Plane<float>, 3> site_variance_e2;  // variances of R, G, B
};

}  // namespace lowlux::isp
