#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoiser.h"
#include "denoise/line_noise.h"
#include "denoise/temporal.h"
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

  bool reduces() const { return level || temporal; }
};

/// The level for the signal to noise ratio of one pixel. None from 60 on, where no difference can be seen; draft from
/// 20 on, standard from 3 on; high below, where chroma starts coarse, which makes it cheap.
std::optional<denoise::Level> level_for(double snr);

/// What is known of what is left, for each 2x2 cell of the picture: see denoise::DenoiseMaps.
struct NoiseMaps {
  Plane<float> residual_variance_e2;
  Plane<float> chroma_confidence;
  std::array<Plane<float>, 3> site_variance_e2;  // of R, G, B
};

}  // namespace lowlux::isp
