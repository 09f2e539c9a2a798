#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/synthetic/scene.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/cli/simulate/simulate_args.h"

namespace lowlux::cli {

/// Holds the scene that the arguments describe, and warnings of its source.
struct SceneOfArgs {
  capture::Scene scene;
  double white_luminance_cd_m2 = 1;  // luminance of (1, 1, 1) in the truth
  std::vector<std::string> warnings;
};

/// Returns the scene of the arguments. Lights from tables are resampled to steps of at most 5 nm in 200 to 2500 nm:
/// they are linear between their nodes, and the functions integrated over them are not. Errors: a file that cannot be
/// read, an unknown light or chart (near matches are offered), a chart's reflectance above 2 (a table in percent), an
/// invalid scene; a size or a light for an image, which has its own.
Result<SceneOfArgs> scene_of(const SceneArgs& args, std::uint64_t seed, Executor& executor);

/// Returns a light by name, or from a table's file (.csv) with one spectrum, sampled as in scene_of. Errors, with the
/// option: those of lights in scene_of.
Result<Spectrum> light_of(const std::string& name, const std::string& option);

}  // namespace lowlux::cli
