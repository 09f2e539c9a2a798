#pragma once

#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/methods/method_scenes.h"
#include "isp/bench/methods/method_score.h"
#include "isp/bench/scenes/denoise_scene.h"

namespace lowlux::isp {

/// One method in one light: means over the scenes.
struct MethodRow {
  std::string light;   // name_of(DenoiseLight)
  std::string method;  // name_of_noise_free and name_of_noisy are not methods
  std::string run_as;  // "program", "function"; empty: not run
  MethodScore score;
  double ms_per_mp = 0;      // wall clock; not a number where nothing was run
  double cpu_ms_per_mp = 0;  // processor time of all threads
  double peak_mib = 0;       // largest resident memory; not a number where it is not known
  int rank = 0;              // by PSNR in its light, 1 the best; 0: the noise-free mosaic, which is not ranked
  bool undominated = false;  // no other method of its light is faster and as good in CIEDE2000, or better and as fast
};

inline constexpr const char* name_of_noise_free = "noise-free";  // the mean of the mosaic: the error of demosaicing
inline constexpr const char* name_of_noisy = "noisy";            // the raw frame as it is given to methods

/// Sorts each light's rows by rank, and sets rank and undominated.
void rank_methods(std::vector<MethodRow>& rows);

/// Returns the rows as a table.
BenchTable methods_table(std::span<const MethodRow> rows);

/// Part of the image that a method made.
struct MethodPart {
  std::string method;
  Encoded8 codes;
};

/// Returns the middle of a display image as sRGB codes, at most 256 x 256 pixels.
Encoded8 middle_codes(const SceneLinear& display);

/// Returns the lights: 200, 20 and 4 e- over 2 e- of dark charge; quick: 20 e-.
std::vector<DenoiseLight> methods_lights(bool quick);

/// Returns table, plots of CIEDE2000 against time, images, and remarks on what was measured.
BenchOutcome methods_outcome(std::span<const MethodRow> rows, std::vector<MethodPart> parts);

/// Returns everything that is needed to repeat a run: seed, scenes, sensor, lights, limits, commands.
std::vector<BenchSetting> methods_settings(const BenchOptions& options, std::span<const MethodScene> scenes,
                                           std::span<const DenoiseLight> lights);

/// Runs the stage `methods`: scores BenchOptions::methods on the same raw frames. A method that fails on a frame is
/// left out, and BenchOutcome::failures says why. Errors: an image cannot be read.
Result<BenchOutcome> run_methods_bench(const BenchOptions& options);

}  // namespace lowlux::isp
