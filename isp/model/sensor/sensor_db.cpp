#include "isp/model/sensor/sensor_db.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/text_table.h"

namespace lowlux::isp {
namespace {

constexpr std::string_view thesis_rows = "thesis_dxc930_model_";

const TextTable& sensors() {
  static const TextTable table(sensors_text());
  return table;
}

/// Returns the name that users give: the three rows of the thesis' sensor have the same.
std::string_view name_of(int row) {
  const std::string_view name = sensors().text(row, "name");
  return name.starts_with(thesis_rows) ? thesis_sensor : name;
}

std::vector<int> rows_of(std::string_view name) {
  std::vector<int> rows;
  for (int row = 0; row < sensors().rows(); ++row) {
    if (name_of(row) == name) rows.push_back(row);
  }
  return rows;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// Returns whether `wanted` is `setting`, or one of its words.
bool is_setting(std::string_view setting, std::string_view wanted) {
  const std::string whole = lower(setting), word = lower(wanted);
  if (whole == word) return true;
  for (std::size_t at = whole.find(word); at != std::string::npos; at = whole.find(word, at + 1)) {
    const bool begins = at == 0 || whole[at - 1] == ' ' || whole[at - 1] == '=';
    const std::size_t end = at + word.size();
    if (begins && (end == whole.size() || whole[end] == ' ')) return true;
  }
  return false;
}

std::string list(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

/// States the camera whose spectral sensitivities a sensor gets, and whether they are its own.
struct CameraOf {
  std::string_view sensor;
  std::string_view camera;
  bool own;
};
constexpr std::array cameras{
    CameraOf{"thesis", "Sony_DXC-930", true},
    CameraOf{"ELD_CanonEOS5D4", "Canon_EOS_5D_Mark_IV", true},
    CameraOf{"ELD_CanonEOS70D", "Canon_EOS_600D", false},
    CameraOf{"ELD_CanonEOS700D", "Canon_EOS_600D", false},
    CameraOf{"ELD_NikonD850", "Nikon_D850", true},
    CameraOf{"ELD_SonyA7S2", "Sony_ILCE-7SM2", true},
    CameraOf{"Canon_EOS_40D", "Canon_EOS_5D_Mark_II", false},
};
constexpr std::string_view stand_in_camera = "Nikon_D5100";

/// Returns the row of the ELD calibration for one camera at one ISO.
std::optional<int> eld_row(const TextTable& table, std::string_view name, double iso) {
  if (!name.starts_with("ELD_")) return std::nullopt;
  for (int row = 0; row < table.rows(); ++row) {
    if (table.text(row, "camera") == name.substr(4) && table.number(row, "iso") == iso) return row;
  }
  return std::nullopt;
}

Result<int> find_row(std::string_view name, std::string_view gain) {
  const std::vector<int> rows = rows_of(name);
  if (rows.empty()) {
    const auto names = sensor_names();
    const auto near = near_matches(name, names);
    return fail(ErrorCode::invalid_argument,
                "unknown sensor '" + std::string(name) + "'; " +
                    (near.empty() ? "there are " + list(names) : "near it: " + list(near)));
  }
  if (gain.empty()) return rows.front();
  for (const int row : rows) {
    if (is_setting(sensors().text(row, "gain_setting"), gain)) return row;
  }
  return fail(ErrorCode::invalid_argument, "the sensor " + std::string(name) + " has no figures for gain '" +
                                               std::string(gain) + "', but for " + list(gain_settings(name)));
}

void take_electronics(NamedSensor& out, int row, const SensorFigures& given) {
  const TextTable& t = sensors();
  SensorModel& m = out.model;
  m.bits = given.bits.value_or(static_cast<int>(*t.number(row, "bits")));
  const double largest_code = std::exp2(m.bits) - 1;
  const auto black = given.black_level_dn ? given.black_level_dn : t.number(row, "black_level_DN");
  m.black_level_dn = black.value_or(std::exp2(m.bits - 4));
  out.black_level_is_sourced = black.has_value();
  if (!black) out.assumptions.push_back("black level " + number_text(m.black_level_dn, 6) + " DN");
  m.white_level_dn = given.white_level_dn.value_or(t.number(row, "white_level_DN").value_or(largest_code));
  m.system_gain_dn_per_e =
      given.system_gain_dn_per_e ? *given.system_gain_dn_per_e : *t.number(row, "conversion_gain_DN_per_e");
  const auto full_well = given.full_well_e ? given.full_well_e : t.number(row, "full_well_e");
  m.full_well_e = full_well.value_or((m.white_level_dn - m.black_level_dn) / m.system_gain_dn_per_e);
  if (!full_well) out.assumptions.push_back("full well " + number_text(m.full_well_e, 6) + " e-: the charge at white");
  m.read_noise_e = given.read_noise_e ? *given.read_noise_e : *t.number(row, "read_noise_e");
  m.quantisation =
      given.quantisation.value_or(out.model.name == thesis_sensor ? Quantisation::floor : Quantisation::round);
}

/// Returns the electronics that the table states, completed by given figures only where it has none.
SensorModel published_electronics(std::string_view name, int row, const SensorFigures& given) {
  const TextTable& t = sensors();
  SensorFigures missing;
  if (!t.number(row, "bits")) missing.bits = given.bits;
  if (!t.number(row, "conversion_gain_DN_per_e")) missing.system_gain_dn_per_e = given.system_gain_dn_per_e;
  if (!t.number(row, "read_noise_e")) missing.read_noise_e = given.read_noise_e;
  NamedSensor out;
  out.model.name = name;
  take_electronics(out, row, missing);
  return out.model;
}

void take_dark_current(NamedSensor& out, int row, const SensorFigures& given) {
  const TextTable& t = sensors();
  SensorModel& m = out.model;
  if (given.dark_current_e_per_s) {
    m.dark_current_e_per_s = *given.dark_current_e_per_s;
  } else if (m.name == thesis_sensor) {
    for (int k = 0; k < 3; ++k) m.dark_current_e_per_s[k] = *t.number(row + k, "dark_current_e_per_s");
  } else if (const auto dark = t.number(row, "dark_current_e_per_s")) {
    m.dark_current_e_per_s = {*dark, *dark, *dark};
  } else {
    out.assumptions.emplace_back("no dark current");
    return;
  }
  const auto at = given.dark_temperature_c ? given.dark_temperature_c : t.number(row, "dark_temperature_C");
  m.dark_temperature_c = at.value_or(20);
  if (!at) out.assumptions.emplace_back("the dark current is that at 20 C");
  m.dark_floor_e_per_s = given.dark_floor_e_per_s.value_or(0);
  m.dark_activation_ev = given.dark_activation_ev.value_or(0);
  const auto doubling = given.dark_doubling_c ? given.dark_doubling_c : t.number(row, "doubling_temperature_C");
  m.dark_doubling_c = doubling.value_or(7);
  if (!doubling && m.dark_activation_ev == 0) out.assumptions.emplace_back("the dark current doubles every 7 C");
}

void take_fixed_pattern(NamedSensor& out, const SensorFigures& given) {
  static const TextTable eld(noise_eld_per_iso_text());
  SensorModel& m = out.model;
  m.prnu = given.prnu.value_or(0);
  m.dsnu = given.dsnu.value_or(0);
  m.hot_pixel_fraction = given.hot_pixel_fraction.value_or(0);
  m.hot_pixel_current_e_per_s = given.hot_pixel_current_e_per_s.value_or(0);
  m.telegraph_fraction = given.telegraph_fraction.value_or(0);
  m.telegraph_e = given.telegraph_e.value_or(0);
  m.crosstalk = given.crosstalk.value_or(0);
  m.glow_e_per_s = given.glow_e_per_s.value_or(m.glow_e_per_s);
  m.glow_position = given.glow_position.value_or(m.glow_position);
  m.glow_length = given.glow_length.value_or(m.glow_length);
  m.column_noise_e = given.column_noise_e.value_or(0);
  const auto row = out.iso ? eld_row(eld, m.name, *out.iso) : std::nullopt;
  m.row_noise_e = given.row_noise_e.value_or(row ? *eld.number(*row, "row_e") : 0);
  std::string absent;
  for (const auto& [known, name] : {std::pair{given.prnu.has_value(), "PRNU"},
                                    {given.dsnu.has_value(), "DSNU"},
                                    {given.hot_pixel_fraction.has_value(), "hot pixels"},
                                    {given.row_noise_e.has_value() || row.has_value(), "row noise"},
                                    {given.column_noise_e.has_value(), "column noise"}}) {
    if (!known) absent += (absent.empty() ? "no " : ", ") + std::string(name);
  }
  if (!absent.empty()) out.assumptions.push_back(absent);
}

struct UnknownFigure {
  std::string_view what;
  std::string_view option;
};

/// Returns the unknown figures among those that simulation requires.
std::vector<UnknownFigure> unknown_electronics(int row, const SensorFigures& given) {
  std::vector<UnknownFigure> unknown;
  const auto need = [&](bool known, const UnknownFigure& figure) {
    if (!known) unknown.push_back(figure);
  };
  const TextTable& t = sensors();
  need(given.bits || t.number(row, "bits"), {"the converter's bits", "--bits"});
  need(given.system_gain_dn_per_e || t.number(row, "conversion_gain_DN_per_e"), {"its gain", "--system-gain"});
  need(given.read_noise_e || t.number(row, "read_noise_e"), {"its read noise", "--read-noise"});
  return unknown;
}

Result<void> check_sourced(std::string_view name, int row, const SensorFigures& given) {
  std::string what, options;
  for (const UnknownFigure& figure : unknown_electronics(row, given)) {
    what += (what.empty() ? "" : ", ") + std::string(figure.what);
    options += (options.empty() ? "" : ", ") + std::string(figure.option);
  }
  if (what.empty()) return {};
  return fail(ErrorCode::insufficient, "no source gives " + what + "; give " + options, std::string(name));
}

/// Returns the ISO speed in the name of a gain setting.
std::optional<double> iso_of(std::string_view gain_setting) {
  constexpr std::string_view prefix = "ISO ";
  if (!gain_setting.starts_with(prefix)) return std::nullopt;
  double iso = 0;
  const auto read =
      std::from_chars(gain_setting.data() + prefix.size(), gain_setting.data() + gain_setting.size(), iso);
  return read.ec == std::errc() ? std::optional(iso) : std::nullopt;
}

void take_camera(NamedSensor& out, const SensorFigures& given) {
  if (given.camera) {
    out.camera = *given.camera;
    return;
  }
  const auto* const own =
      std::find_if(cameras.begin(), cameras.end(), [&](const CameraOf& c) { return c.sensor == out.model.name; });
  out.camera = own == cameras.end() ? stand_in_camera : own->camera;
  if (own == cameras.end() || !own->own) out.assumptions.push_back("the colours of a " + out.camera);
}

}  // namespace

std::vector<std::string_view> sensor_names() {
  std::vector<std::string_view> names;
  for (int row = 0; row < sensors().rows(); ++row) {
    if (std::find(names.begin(), names.end(), name_of(row)) == names.end()) names.push_back(name_of(row));
  }
  return names;
}

std::vector<std::string_view> gain_settings(std::string_view name) {
  std::vector<std::string_view> settings;
  for (const int row : rows_of(name)) {
    const std::string_view setting = sensors().text(row, "gain_setting");
    if (std::find(settings.begin(), settings.end(), setting) == settings.end()) settings.push_back(setting);
  }
  return settings;
}

std::string_view own_camera(std::string_view sensor) {
  const auto* const own = std::ranges::find_if(cameras, [&](const CameraOf& c) { return c.sensor == sensor && c.own; });
  return own == cameras.end() ? std::string_view() : own->camera;
}

std::vector<std::string_view> options_needed(std::string_view name, std::string_view gain) {
  const Result<int> row = find_row(name, gain);
  if (!row) return {};
  std::vector<std::string_view> options;
  for (const UnknownFigure& figure : unknown_electronics(*row, {})) options.push_back(figure.option);
  // The thesis' sensor has its own scale.
  if (name == thesis_sensor || iso_of(sensors().text(*row, "gain_setting"))) return options;
  if (!sensors().number(*row, "pixel_pitch_um")) options.emplace_back("--pixel-pitch");
  if (!sensors().number(*row, "peak_qe")) options.emplace_back("--peak-qe");
  return options;
}

Result<NamedSensor> sensor_named(std::string_view name, std::string_view gain, const SensorFigures& figures) {
  const Result<int> row = find_row(name, gain);
  if (!row) return tl::make_unexpected(row.error());
  if (const auto complete = check_sourced(name, *row, figures); !complete) {
    return tl::make_unexpected(complete.error());
  }
  NamedSensor out;
  out.model.name = name;
  out.gain_setting = sensors().text(*row, "gain_setting");
  out.source = sensors().text(*row, "source");
  out.pixel_pitch_um = figures.pixel_pitch_um ? figures.pixel_pitch_um : sensors().number(*row, "pixel_pitch_um");
  out.peak_quantum_efficiency =
      figures.peak_quantum_efficiency ? figures.peak_quantum_efficiency : sensors().number(*row, "peak_qe");
  out.iso_given = figures.iso.has_value();
  out.iso = out.iso_given ? figures.iso : iso_of(out.gain_setting);
  take_electronics(out, *row, figures);
  out.published = published_electronics(name, *row, figures);
  take_dark_current(out, *row, figures);
  take_fixed_pattern(out, figures);
  take_camera(out, figures);
  if (const auto possible = check_sensor(out.model); !possible) return tl::make_unexpected(possible.error());
  return out;
}

}  // namespace lowlux::isp
