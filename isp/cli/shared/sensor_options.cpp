#include "isp/cli/shared/sensor_options.h"

#include <array>

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::cli {

void add_sensor_figures(CLI::App& app, const std::string& group, isp::SensorFigures& figures,
                        std::optional<double>& white_luminance_cd_m2) {
  const auto figure = [&](const std::string& flag, const std::string& type, const std::string& help,
                          std::optional<double>& out) {
    add_number(app, flag, type, help, [&out](double value) { out = value; })->group(group);
  };
  figure("--system-gain", "DN_PER_E", "system gain in DN per electron", figures.system_gain_dn_per_e);
  figure("--read-noise", "E", "read noise, standard deviation in electrons", figures.read_noise_e);
  figure("--full-well", "E", "full-well capacity in electrons", figures.full_well_e);
  app.add_option("--bits", figures.bits, "bits of the analogue-to-digital converter")->type_name("N")->group(group);
  add_text(app, "--dark-current", "E_PER_S[,G,B]", "dark current of all channels, or of red, green and blue",
           [&figures](const std::string& text) -> ArgumentError {
             const auto n = numbers_of(text, 3);
             if (!n || n->size() == 2) return "is neither one number nor three";
             figures.dark_current_e_per_s = std::array{n->front(), n->size() == 3 ? (*n)[1] : n->front(), n->back()};
             return std::nullopt;
           })
      ->group(group);
  figure("--pixel-pitch", "UM", "side of a pixel", figures.pixel_pitch_um);
  figure("--peak-qe", "RATIO", "peak quantum efficiency, in electrons per photon", figures.peak_quantum_efficiency);
  figure("--iso", "ISO", "saturation-based speed of the gain setting", figures.iso);
  figure("--white-luminance", "CD_M2", "luminance of a white that reaches full well in 1 s", white_luminance_cd_m2);
}

}  // namespace lowlux::cli
