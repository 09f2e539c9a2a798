#pragma once

#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace lowlux::isp {
struct SensorFigures;
}

namespace lowlux::cli {

/// Adds the options that replace figures of a named sensor, for simulation and for exposure advice.
/// @param group  title of the options in the help
void add_sensor_figures(CLI::App& app, const std::string& group, isp::SensorFigures& figures,
                        std::optional<double>& white_luminance_cd_m2);

}  // namespace lowlux::cli
