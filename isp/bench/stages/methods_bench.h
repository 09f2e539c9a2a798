#pragma once

#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/methods/method_scenes.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/bench/stages/method_rows.h"

namespace lowlux::isp {

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
