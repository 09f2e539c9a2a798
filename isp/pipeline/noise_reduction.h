#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoise_options.h"
#include "denoise/lines/line_noise.h"
#include "denoise/temporal/temporal.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// What is asked for.
struct DenoiseChoice {
  enum class Mode : std::uint8_t {
    off,
    automatic,  // by the frame's signal to noise ratio: level_for
    level,
  } mode = Mode::off;
  denoise::Level level = denoise::Level::standard;  // for Mode::level
  bool line_noise = true;                           // rows and columns too, where theirs stands out
  bool maps = false;                                // keep NoiseMaps
  bool always = false;                              // automatic: draft at least
};

/// Frames of a stream before this one take part: see denoise::TemporalMean.
struct TemporalReduction {
  denoise::TemporalOptions options;
  double light = 1;     // on this frame over that on the one before, by exposure time
  bool restart = true;  // nothing is known of frames before
};

/// Levels of the parts of a frame: squares from the corner of the active area on, which cover it.
struct NoiseRegions {
  int size = 0;  // of a side [px]; a multiple of tile_lattice_px
  int columns = 0;
  int rows = 0;
  std::vector<std::optional<denoise::Level>> level;  // rows x columns; absent: noise stays, lines and dark charge go
};

/// The level of a frame, where it is decided together with everything else: see plan_effects.h.
struct DecidedLevel {
  std::optional<denoise::Level> level;
  std::optional<NoiseRegions> regions;  // with levels of their own
};

/// What was decided: everything that reducing the noise of one frame takes. Sites as in the active area.
struct NoiseReduction {
  std::optional<denoise::Level> level;  // absent: values stay as they are
  std::string reason;                   // for that; one line
  std::optional<double> snr;            // of one pixel in the middle block of the frame, by the noise model
  NoiseProfile::Source source = NoiseProfile::Source::file;
  denoise::RawNoise noise;
  denoise::DenoiseOptions options;
  std::vector<denoise::LineOffsets> lines;  // taken off before
  std::optional<TemporalReduction> temporal;
  std::optional<NoiseRegions> regions;  // set: their levels hold, and `level` does not
  std::vector<std::string> warnings;    // what contradicts the noise model

  /// Whether some part of the frame has a level.
  bool has_level() const {
    if (!regions) return level.has_value();
    return std::ranges::any_of(regions->level, [](const auto& of_region) { return of_region.has_value(); });
  }
  bool reduces() const { return has_level() || temporal; }
};

/// The level for the signal to noise ratio of one pixel. None from 60 on, where no difference can be seen; draft from
/// 20 on, standard from 3 on; high below, where chroma starts coarse, which makes it cheap.
std::optional<denoise::Level> level_for(double snr);

/// What is known of what is left, for each 2x2 cell of the picture: see denoise::DenoiseMaps. Where a region keeps its
/// noise, that is what is left, by the mean of 8 x 8 cells, and colour is as it was: its confidence is 1.
struct NoiseMaps {
  Plane<float> residual_variance_e2;
  Plane<float> chroma_confidence;
  std::array<Plane<float>, 3> site_variance_e2;  // of R, G, B
};

}  // namespace lowlux::isp
