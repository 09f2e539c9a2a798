#include "isp/model/sensor/given_figures.h"

#include <algorithm>
#include <string>

namespace lowlux::isp {
namespace {

struct Useless {
  bool is;
  const char* option;
  const char* where;  // what is missing, or given too
  const char* why;
};

bool positive(const std::optional<double>& figure) { return figure && *figure > 0; }

}  // namespace

Result<void> check_given_figures(const SensorFigures& given, const NamedSensor& sensor, const Optics& optics) {
  const SensorModel& m = sensor.model;
  const bool no_dark = std::ranges::all_of(m.dark_current_e_per_s, [](double rate) { return rate == 0; });
  const bool no_pitch = !sensor.peak_quantum_efficiency && !optics.white_luminance_cd_m2;
  constexpr const char* no_dark_current = "the sensor has no dark current";
  constexpr const char* no_glow = "the sensor has no amplifier glow";
  const Useless options[] = {
      {positive(given.hot_pixel_fraction) && m.hot_pixel_current_e_per_s == 0, "--hot-pixels", "without --hot-current",
       "hot pixels are pixels with a larger dark current"},
      {positive(given.hot_pixel_current_e_per_s) && m.hot_pixel_fraction == 0, "--hot-current", "without --hot-pixels",
       "the sensor has no hot pixels"},
      {positive(given.telegraph_fraction) && m.telegraph_e == 0, "--telegraph-pixels", "without --telegraph-noise",
       "telegraph pixels have two levels"},
      {positive(given.telegraph_e) && m.telegraph_fraction == 0, "--telegraph-noise", "without --telegraph-pixels",
       "no pixel of the sensor has telegraph noise"},
      {given.glow_position && m.glow_e_per_s == 0, "--glow-position", "without --glow", no_glow},
      {given.glow_length && m.glow_e_per_s == 0, "--glow-length", "without --glow", no_glow},
      {positive(given.dsnu) && no_dark, "--dsnu", "without --dark-current", no_dark_current},
      {given.dark_temperature_c && no_dark, "--dark-temperature", "without --dark-current", no_dark_current},
      {given.dark_doubling_c && no_dark, "--dark-doubling", "without --dark-current", no_dark_current},
      {positive(given.dark_activation_ev) && no_dark, "--dark-activation", "without --dark-current", no_dark_current},
      {positive(given.dark_floor_e_per_s) && no_dark, "--dark-floor", "without --dark-current", no_dark_current},
      {given.dark_doubling_c && positive(given.dark_activation_ev), "--dark-doubling", "without --dark-activation 0",
       "an activation energy replaces the doubling"},
      {given.pixel_pitch_um && no_pitch, "--pixel-pitch", "without --peak-qe",
       "no source gives the sensor's quantum efficiency"},
      {given.iso && optics.white_luminance_cd_m2, "--iso", "with --white-luminance",
       "both state how much light fills a pixel"},
  };
  const auto* const useless = std::ranges::find_if(options, &Useless::is);
  if (useless == std::ranges::end(options)) return {};
  return fail(ErrorCode::invalid_argument,
              std::string(useless->option) + " does nothing " + useless->where + ": " + useless->why, m.name);
}

}  // namespace lowlux::isp
