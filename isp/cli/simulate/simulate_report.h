#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/synthetic/burst.h"
#include "capture/synthetic/sensor_sim.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {

/// Holds the results of a run of `simulate`.
struct SimulateOutcome {
  isp::NamedSensor sensor;
  std::vector<std::string> files;
  std::optional<isp::NoiseSourcePlan> plan;
  std::optional<capture::EffectCost> cost;  // measured for --explain
  double white_cd_m2 = 0;                   // luminance of white
  std::optional<double> saturation_cd_m2;  // luminance of D65 that saturates in the exposure time; none for a time of 0
  std::vector<std::string> warnings;
  std::vector<isp::StageTime> times;
};

/// Returns for each region the effects, the predicted change of leaving each out, the decision and its reason; then the
/// time saved.
std::string explain_text(const SimulateArgs& args, const SimulateOutcome& outcome);
/// Returns sensor, files and assumptions in a few lines.
std::string simulate_text(const SimulateArgs& args, const SimulateOutcome& outcome);
/// Returns all results as one JSON object.
std::string simulate_json(const SimulateArgs& args, const SimulateOutcome& outcome);
/// Returns the sensors with their gain settings and the options each needs, lights and cameras: as
/// text, and as one JSON object.
std::string simulate_list();
std::string simulate_list_json();

/// Returns the truth of a burst as JSON: size, options and, for each frame, its file, exposure time, motions and boxes
/// of moving objects; then the points of frame 0. Positions are in pixels, integers at their centres; motions are those
/// from frame 0 to the frame: what is at p is at centre + R (p - centre) + (dx, dy), R turning clockwise.
/// @param files files of the frames
std::string burst_truth_json(const SimulateArgs& args, const capture::BurstSource& source,
                             const std::vector<std::string>& files);

}  // namespace lowlux::cli
