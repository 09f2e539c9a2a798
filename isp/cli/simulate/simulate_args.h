#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/file/picture_source.h"
#include "capture/synthetic/synthetic_camera.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/simulate/burst_args.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::cli {

/// Minimum width and height of a raw image: LibRaw, and with it most raw developers, takes smaller ones for thumbnails.
/// Masked columns do not count.
inline constexpr int min_side = 22;
/// Maximum width and height of a raw image: LibRaw refuses greater ones.
inline constexpr int max_side = 64000;

/// Holds a distant lamp: --lamp X,Y,LIGHT,LUMINANCE.
struct LampArgs {
  double x_px = 0, y_px = 0;
  std::string light;
  double luminance_cd_m2 = 0;  // with its light spread over one pixel
};

/// Describes the scene in front of the camera.
struct SceneArgs {
  std::string what;  // an image file, or dark, flat, chart, chart:macbeth, chart:munsell, chart:FILE.csv
  std::shared_ptr<capture::ScenePicture> picture;  // an image in memory, used up; `what` names it in errors
  int width = 1200;
  int height = 800;
  bool size_given = false;
  std::string light = "D65";  // a name, or a table's file
  bool light_given = false;
  double luminance_cd_m2 = 1;
  bool luminance_given = false;
  int stars = 0;
  std::optional<double> star_luminance_cd_m2;  // luminance of the faintest star; absent: a tenth of the scene's
  std::vector<LampArgs> lamps;
  int reduction = 1;  // generated scenes have so many samples for each pixel of --size and axis
};

/// Holds the arguments of `simulate`.
struct SimulateArgs {
  SceneArgs scene;
  std::string output;  // NIGHT.dng; several frames are NIGHT_0000.dng...
  std::string truth;   // empty: OUT.truth.exr
  bool no_truth = false;
  std::string truth_electrons;  // empty: not written
  std::string sensor = "ELD_NikonD850";
  std::string gain;
  isp::SensorFigures figures;
  isp::Optics optics;
  capture::SyntheticOptions options;
  int frames = 1;
  BurstArgs burst;
  std::string effects;  // text of the option; empty: auto, or all for published sampling
  bool list = false;
  bool explain = false;
  bool force = false;
  bool json = false;
  bool timings = false;
  bool quiet = false;
};

Parsed<SimulateArgs> parse_simulate(const std::vector<std::string>& words);

}  // namespace lowlux::cli
