#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/synthetic/sensor_sim.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/model/sensor/effect_plan.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {

/// What a run of `simulate` has to say.
struct SimulateOutcome {
  isp::NamedSensor sensor;
  std::vector<std::string> files;
  std::optional<isp::EffectPlan> plan;
  std::optional<capture::EffectCost> cost;  // measured for --explain
  double white_cd_m2 = 0;                   // luminance of white
  std::optional<double> saturation_cd_m2;   // luminance of D65 that saturates in the exposure time; none in no time
  std::vector<std::string> warnings;
  std::vector<isp::StageTime> times;
};

/// For each region the effects, what leaving each out was predicted to change, the decision and why; then what was
/// saved.
std::string explain_text(const SimulateArgs& args, const SimulateOutcome& outcome);
/// Sensor, files and assumptions, a few lines.
std::string simulate_text(const SimulateArgs& args, const SimulateOutcome& outcome);
/// All of it as one JSON object.
std::string simulate_json(const SimulateArgs& args, const SimulateOutcome& outcome);
/// The sensors with their gain settings and the options each needs, lights and cameras.
std::string simulate_list();

}  // namespace lowlux::cli
