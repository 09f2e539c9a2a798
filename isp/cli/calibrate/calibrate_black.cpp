#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_library.h"
#include "calib/dark/dark_series.h"
#include "calib/dark/dark_temperature.h"
#include "calib/dark/light_in_darks.h"
#include "calib/profile/profile_use.h"
#include "isp/base/camera_profile.h"
#include "isp/base/cfa.h"
#include "isp/cli/calibrate/black_report.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/progress.h"
#include "isp/raw/black_point.h"
#include "isp/raw/measure/masked_black.h"

namespace lowlux::cli {
namespace {

constexpr double light_of_range = 0.005;  // maximum excess of the image over the masked pixels
constexpr double much_light = 0.1;        // of the range above the tagged black level
constexpr double light_of_noise = 10;     // the maximum in standard deviations of the masked pixels

/// Checks that a dark frame is as dark as its own masked pixels, if it has some.
Result<void> check_dark(const RawFrame& frame) {
  const RawDn& raw = frame.raw;
  const isp::MaskedBlack masked = isp::masked_black_of(frame);
  if (!masked.black) return {};
  const double black = mean_of_sites(masked.black->pedestal_dn), mean = calib::mean_dn(raw);
  const double tolerated = std::max(light_of_noise * mean_of_sites(masked.black->noise_std_dn),
                                    light_of_range * isp::mean_range_dn(raw, *masked.black));
  if (mean - black <= tolerated) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("light reaches this frame: its mean is {:.1f} DN, that of its masked pixels {:.1f} DN; cover "
                          "the lens, or measure the masked pixels with --masked",
                          mean, black));
}

Result<RawDn> dark_part(RawFrame frame, const CalibrateBlackArgs& args) {
  if (!args.masked) {
    if (const auto dark = check_dark(frame); !dark) return tl::make_unexpected(dark.error());
    return std::move(frame.raw);
  }
  const isp::MaskedBlack masked = isp::measure_masked_black(frame.raw);  // only the region is used
  if (!masked.black) return fail(ErrorCode::insufficient, masked.refusal);
  return calib::part_of(frame.raw, masked.region);
}

/// Holds the darks by setting, and the camera.
struct Darks {
  std::vector<calib::DarkSet> sets;
  std::vector<std::pair<std::optional<double>, std::string>> files;  // names with the ISO of each
  FrameInfo camera;
  std::string mosaic;
  isp::Table frames;
  std::vector<std::pair<std::optional<double>, double>> gains_dn_per_e;  // that files state, with the ISO of each
  struct Levels {
    std::optional<double> iso;
    PerSite<double> black_dn{};
    double white_dn = 0;
  };
  std::vector<Levels> tagged;  // that files state, with the ISO of each
};

/// Returns the system gain that the noise profile of a frame states [DN/e-]; nullopt if there is none.
std::optional<double> stated_gain(const RawFrame& frame) {
  if (!frame.noise) return std::nullopt;
  const auto tag = isp::choose_black(frame.raw, {});
  if (!tag) return std::nullopt;
  const double gain = *std::ranges::max_element(frame.noise->scale) * isp::mean_range_dn(frame.raw, *tag);
  return gain > 0 ? std::optional(gain) : std::nullopt;
}

calib::Measured measured_on(const Darks& darks, const std::optional<double>& iso) {
  std::vector<std::string> files;
  for (const auto& [own, file] : darks.files) {
    if (own == iso) files.push_back(file);
  }
  return measured_today(std::move(files));
}

Result<Darks> read_dark_series(const CalibrateBlackArgs& args) {
  calib::DarkSorter sorter;
  Darks out;
  Progress progress(static_cast<int>(args.common.frames.size()), !args.common.quiet);
  for (const std::string& file : args.common.frames) {
    auto frame = read_calibration_frame(file, args.common);
    if (!frame) return tl::make_unexpected(frame.error());
    out.camera = frame->raw.info;
    out.mosaic = calib::mosaic_of(frame->raw);
    out.files.emplace_back(frame->raw.info.iso, file);
    list_frame(file, args.masked ? "masked pixels" : "dark", frame->raw.info, out.frames);
    const auto tagged = isp::choose_black(frame->raw, {.choice = isp::BlackChoice::metadata});
    if (tagged) {
      out.tagged.push_back({frame->raw.info.iso, tagged->pedestal_dn, *std::ranges::min_element(frame->raw.white_dn)});
    }
    if (const auto gain = stated_gain(*frame)) out.gains_dn_per_e.emplace_back(frame->raw.info.iso, *gain);
    const auto dark = dark_part(*std::move(frame), args);
    if (!dark) return tl::make_unexpected(with_file(dark.error(), file));
    if (const auto added = sorter.add(*dark); !added) return tl::make_unexpected(with_file(added.error(), file));
    progress.advance(1, file);
  }
  out.sets = sorter.sets();
  return out;
}

/// Warns of frames that light may have reached: those far above the black level of their files, and those that are
/// brighter on one side.
void warn_of_light(const calib::DarkGroup& group, const Darks& darks, std::vector<std::string>& warnings) {
  const PerSite<calib::DarkSite> sites = calib::sites_of(group);
  const auto tagged = std::ranges::find(darks.tagged, group.setting.iso, &Darks::Levels::iso);
  const bool is_tagged = tagged != darks.tagged.end();
  if (is_tagged) {
    double level_dn = 0;
    for (const calib::DarkSite& site : sites) level_dn += site.spread.median / 4;
    const double black_dn = mean_of_sites(tagged->black_dn),
                 fraction = (level_dn - black_dn) / (tagged->white_dn - black_dn);
    if (fraction > much_light) {
      warnings.push_back(fmt::format(
          "the frames{} are {:.0f} % of the range above the black level of their files: if light reached the sensor, "
          "cover the lens and take them again",
          group.setting.exposure_s ? fmt::format(" of {:g} s", *group.setting.exposure_s) : "", 100 * fraction));
    }
  }
  if (!group.setting.exposure_s) return;
  if (const auto even =
          calib::check_even_dark(group, sites, is_tagged ? std::optional(tagged->black_dn) : std::nullopt);
      !even) {
    warnings.push_back(even.error().message);
  }
}

/// Warns of dark current that does not double with a fixed number of degrees, as profiles state it.
void warn_of_law(const calib::DarkSeries& series, std::vector<std::string>& warnings) {
  if (!series.law || !(series.law->misfit > 0)) return;
  warnings.push_back(
      fmt::format("from {:g} to {:g} C the dark current does not double at a constant temperature interval: the "
                  "profile has errors of up to {:.2g} %; use only darks of the temperatures of the images",
                  series.law->lowest_c, series.law->highest_c, 100 * series.law->misfit));
}

struct Gain {
  Estimate dn_per_e;
  std::string source;
};

/// Returns the gain that is given, or that the profile to be extended holds.
std::optional<Gain> known_gain(const calib::DarkSet& set, const CalibrateBlackArgs& args,
                               const CameraProfile& profile) {
  if (args.system_gain_dn_per_e) return Gain{{*args.system_gain_dn_per_e, 0}, "given"};
  for (const GainProfile& g : profile.gains) {
    if (g.iso == set.iso && g.sensor) {
      return Gain{{g.sensor->system_gain_dn_per_e, g.errors.system_gain_dn_per_e}, "from " + args.common.add_to};
    }
  }
  return std::nullopt;
}

Result<Gain> gain_of(const calib::DarkSet& set, const CalibrateBlackArgs& args, const CameraProfile& profile) {
  if (auto known = known_gain(set, args, profile)) return *std::move(known);
  const auto gain = calib::gain_of_darks(set.groups);
  if (!gain) return tl::make_unexpected(gain.error());
  return Gain{*gain, "from the noise of the dark charge"};
}

/// Returns the gain by which a level of one exposure time keeps the pixels that hold single electrons: 0 if none is
/// known.
double level_gain(const calib::DarkSet& set, const Darks& darks, const CalibrateBlackArgs& args,
                  const CameraProfile& profile) {
  if (const auto known = known_gain(set, args, profile)) return known->dn_per_e.value;
  const auto stated = std::ranges::find(darks.gains_dn_per_e, set.iso, [](const auto& gain) { return gain.first; });
  return stated == darks.gains_dn_per_e.end() ? 0 : stated->second;
}

bool tells_dark_current(const calib::DarkSet& set) {
  return std::ranges::any_of(set.groups, [&](const calib::DarkGroup& g) {
    return g.setting.exposure_s != set.groups.front().setting.exposure_s;
  });
}

std::string map_name(const CalibrateBlackArgs& args, const calib::DarkSet& set, bool several, const char* what) {
  const std::string iso = several && set.iso ? fmt::format("_iso{:g}", *set.iso) : "";
  return fmt::format("{}{}_{}.pfm", args.map, iso, what);
}

/// Calibrates from one exposure time, which determines only the black level including dark charge.
/// @param gain_dn_per_e  0 if it is not known
Result<void> calibrate_black_level(const calib::DarkSet& set, const calib::Measured& measured, double gain_dn_per_e,
                                   const CalibrateBlackArgs& args, Calibration& found) {
  if (set.groups.size() > 1) {
    return fail(ErrorCode::insufficient,
                fmt::format("the darks have one exposure time and {} temperatures: add a second exposure time to "
                            "measure dark current, or use one temperature to measure the black level",
                            set.groups.size()));
  }
  if (!args.map.empty()) {
    found.warnings.emplace_back("--map has no effect: dark current needs a second exposure time");
  }
  const calib::DarkGroup& group = set.groups.front();
  const auto black = calib::measure_black(group, gain_dn_per_e);
  if (!black) return tl::make_unexpected(black.error());
  calib::put_black(*black, group.setting, measured, calib::gain_at(found.profile, group.setting));
  show_black(*black, group.setting, found);
  return {};
}

/// Fits the quantities that the frames of one gain setting determine.
Result<void> calibrate_set(const calib::DarkSet& set, const Darks& darks, const CalibrateBlackArgs& args,
                           Calibration& found) {
  const calib::Measured measured = measured_on(darks, set.iso);
  if (!args.masked) {
    for (const calib::DarkGroup& group : set.groups) warn_of_light(group, darks, found.warnings);
  }
  if (!tells_dark_current(set)) {
    return calibrate_black_level(set, measured, level_gain(set, darks, args, found.profile), args, found);
  }
  const auto gain = gain_of(set, args, found.profile);
  if (!gain) return tl::make_unexpected(gain.error());
  auto series = calib::fit_dark_series(set.groups, gain->dn_per_e);
  if (!series) return tl::make_unexpected(series.error());
  warn_of_law(*series, found.warnings);
  GainProfile& profile = calib::gain_at(found.profile, set.groups.front().setting);
  calib::put_dark_series(*series, set.groups, gain->dn_per_e, measured, profile);
  if (args.masked) profile.hot_pixels.clear();  // their coordinates are not those of active pixels
  show_dark_series(*series, set.groups, profile, gain->source, found);
  if (args.map.empty()) return {};
  const bool several = darks.sets.size() > 1;
  found.maps.push_back({map_name(args, set, several, "pedestal"), std::move(series->pedestal_map_dn)});
  found.maps.push_back({map_name(args, set, several, "current"), std::move(series->current_map_e_per_s)});
  return {};
}

}  // namespace

Result<Calibration> calibrate_black(const CalibrateBlackArgs& args) {
  if (const auto good = check_outputs(args.common); !good) return tl::make_unexpected(good.error());
  auto profile = starting_profile(args.common);
  if (!profile) return tl::make_unexpected(profile.error());
  const auto darks = read_dark_series(args);
  if (!darks) return tl::make_unexpected(darks.error());
  Calibration found;
  found.profile = std::move(*profile);
  found.frames = darks->frames;
  found.report.title = camera_name(darks->camera.make, darks->camera.model) + ": black level and dark current";
  if (const auto same = put_camera(darks->camera, found.profile); !same) return tl::make_unexpected(same.error());
  if (const auto same = put_mosaic(darks->mosaic, found.profile); !same) return tl::make_unexpected(same.error());
  for (const calib::DarkSet& set : darks->sets) {
    const auto done = calibrate_set(set, *darks, args, found);
    if (!done) return tl::make_unexpected(done.error());
  }
  return found;
}

int run_calibrate_black(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_black(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateBlackArgs>(parsed);
  const auto found = calibrate_black(args);
  return found ? finish(args.common, *found) : calibration_failed(args.common, found.error());
}

}  // namespace lowlux::cli
