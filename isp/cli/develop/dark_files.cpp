#include "isp/cli/develop/dark_files.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <numeric>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_library.h"
#include "calib/dark/light_in_darks.h"
#include "capture/file/dng_source.h"
#include "isp/base/executor.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/raw/black_point.h"
#include "isp/raw/measure/masked_black.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

Result<double> doubling_of_profile(const std::string& file, const calib::FrameSetting& setting) {
  Result<CameraProfile> profile = read_profile(file);
  if (!profile) return tl::make_unexpected(profile.error());
  FrameInfo camera;
  camera.make = setting.make;
  camera.model = setting.model;
  if (const auto same = put_camera(camera, *profile); !same) {
    return fail(same.error().code, same.error().message, file);
  }
  for (const GainProfile& gain : profile->gains) {
    if (gain.sensor && gain.errors.dark_doubling_c > 0) return gain.sensor->dark_doubling_c;
  }
  return fail(ErrorCode::insufficient,
              "the profile has no measured doubling temperature of the dark current; calibrate it with darks of two "
              "temperatures",
              file);
}

/// Returns the values of a master in the codes of an image.
Plane<float> in_codes(const MosaicTiff& master, const RawDn& picture) {
  Plane<float> out = master.dn.clone();
  if (!master.white) return out;
  const auto scale = static_cast<float>(*std::ranges::min_element(picture.white_dn) / *master.white);
  std::transform(out.data(), out.data() + out.size(), out.data(), [=](float v) { return v * scale; });
  return out;
}

std::string unchecked_text(const MosaicTiff& master) {
  std::string text = fmt::format(
      "{}: a {} does not state all of camera, ISO, exposure time, temperature and orientation; those of the image are "
      "assumed",
      master.file, master.white ? "floating-point DNG" : "TIFF");
  if (master.scaled) text += "; its values are at most 1 and interpreted as fractions of 65535";
  return text;
}

/// Replaces the codes by the signal on top of the mean of the dark frame [DN].
void subtract(const DarkFrame& dark, const BlackPoint& black, RawDn& raw) {
  const int width = raw.active.width, height = raw.active.height;
  Plane<float> signal(width, height);
  InlineExecutor alone;  // other threads read other files
  isp::to_fraction(raw, dark, black, signal.view(), alone);
  PerSite<float> mean{}, range{};
  for (int site = 0; site < 4; ++site) {
    mean[site] = static_cast<float>(black.pedestal_dn[site]);
    range[site] = static_cast<float>(isp::white_at(raw, site)) - mean[site];
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float& v = signal.at(x, y);
      v = v * range[site_of(x, y)] + mean[site_of(x, y)];
    }
  }
  raw.dn = {};
  raw.dn_float = std::move(signal);
  raw.active = {0, 0, width, height};
  raw.masked.clear();
  raw.masked_is_stated = false;
  raw.black_tag =
      BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {black.pedestal_dn.begin(), black.pedestal_dn.end()}};
}

void add_variance(const DarkFrame& dark, double range_dn, NoiseProfile& noise) {
  const auto& added = dark.added_variance_dn2;
  const double mean_dn2 = std::accumulate(added.begin(), added.end(), 0.0) / 4;
  for (double& offset : noise.offset) offset += mean_dn2 / (range_dn * range_dn);
}

}  // namespace

std::optional<calib::DarkNoiseModel> noise_model_of(const RawDn& raw, const NoiseProfile& noise,
                                                    const PerSite<double>& pedestal_dn) {
  const auto electrons = isp::electrons_at_white(raw, noise);
  if (!electrons) return std::nullopt;
  calib::DarkNoiseModel out;
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1));
    const double range_dn = isp::white_at(raw, site) - pedestal_dn[site];
    out.gain_dn_per_e[site] = range_dn / (*electrons)[site];
    out.read_variance_dn2[site] = std::max(0.0, noise.offset[colour] * range_dn * range_dn);
  }
  return out;
}

Result<void> check_no_picture(const std::vector<Job>& jobs, const std::vector<std::string>& files, const char* option,
                              const char* kind) {
  for (const Job& job : jobs) {
    const auto same = std::ranges::find_if(files, [&](const std::string& file) {
      std::error_code ignored;
      return fs::equivalent(job.input, file, ignored);
    });
    if (same == files.end()) continue;
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} is given as an image and as one of its {}", job.input, kind), option);
  }
  return {};
}

std::vector<std::string> DarkNames::all() const {
  std::vector<std::string> out = darks;
  out.insert(out.end(), bias.begin(), bias.end());
  return out;
}

Result<DarkNames> dark_files(const DevelopArgs& args, const std::vector<Job>& jobs) {
  auto darks = raw_files_of_lists(args.dark.words, args.quiet);
  if (!darks) return tl::make_unexpected(darks.error());
  auto bias = raw_files_of_lists(args.dark.bias, args.quiet);
  if (!bias) return tl::make_unexpected(bias.error());
  const bool level_given = args.options.black.choice != isp::BlackChoice::automatic;
  if ((!darks->empty() && (level_given || !args.black_profile.empty())) || (!bias->empty() && level_given)) {
    return fail(
        ErrorCode::invalid_argument,
        "dark frames already contain the black level, and subtracting both causes green shadows; give one of the two",
        "--black");
  }
  if (const auto apart = check_no_picture(jobs, *darks, "--dark-frame", "darks"); !apart) {
    return tl::make_unexpected(apart.error());
  }
  if (const auto apart = check_no_picture(jobs, *bias, "--bias-frame", "bias frames"); !apart) {
    return tl::make_unexpected(apart.error());
  }
  return DarkNames{*std::move(darks), *std::move(bias)};
}

namespace {

Result<void> add_bias(const std::string& file, calib::DarkLibrary& bias) {
  const Result<RawFrame> frame = capture::read_raw(file, {}, capture::keep_x_trans);
  return frame ? bias.add(frame->raw) : tl::make_unexpected(frame.error());
}

/// Adds a file to the masters if it is a TIFF or has floating-point samples, else to the darks.
Result<void> add_dark(const std::string& file, calib::DarkLibrary& darks, std::vector<MosaicTiff>& masters) {
  Result<MosaicTiff> master;
  if (is_tiff_name(file)) {
    master = read_mosaic_tiff(file);
  } else {
    Result<RawFrame> frame = capture::read_raw(file, {}, capture::keep_x_trans);
    if (!frame) return tl::make_unexpected(frame.error());
    if (!frame->raw.is_float()) return darks.add(frame->raw);
    master = mosaic_of(*std::move(frame), file);
  }
  if (!master) return tl::make_unexpected(master.error());
  masters.push_back(*std::move(master));
  return {};
}

Result<DarkFiles> read_files(const DarkNames& names) {
  calib::DarkLibrary darks, bias;
  DarkFiles read;
  for (const std::string& file : names.darks) {
    if (auto added = add_dark(file, darks, read.masters); !added) {
      return tl::make_unexpected(with_file(added.error(), file));
    }
  }
  for (const std::string& file : names.bias) {
    if (is_tiff_name(file)) {
      return fail(ErrorCode::unsupported, "a TIFF states no exposure time; give bias frames as raw files", file);
    }
    if (auto added = add_bias(file, bias); !added) return tl::make_unexpected(with_file(added.error(), file));
  }
  read.groups = darks.groups();
  read.darks = read.groups.size();
  std::ranges::move(bias.groups(), std::back_inserter(read.groups));
  return read;
}

}  // namespace

Result<std::shared_ptr<DarkSource>> read_darks(const DarkNames& names, const DarkArgs& args) {
  auto read = read_files(names);
  if (!read) return tl::make_unexpected(read.error());
  calib::DarkRequest request{.noise_fraction = args.noise_fraction, .doubling_c = args.doubling_c};
  if (!args.doubling_profile.empty()) {
    if (read->groups.empty()) {
      return fail(ErrorCode::invalid_argument, "has no effect on TIFF files, which state no temperature: leave it out",
                  "--dark-doubling");
    }
    const Result<double> doubling = doubling_of_profile(args.doubling_profile, read->groups.front().setting);
    if (!doubling) return tl::make_unexpected(doubling.error());
    request.doubling_c = *doubling;
  }
  return std::make_shared<DarkSource>(*std::move(read), request, args.count);
}

Result<std::shared_ptr<const DarkFrame>> DarkSource::frame_for(RawFrame& picture, const isp::BlackRequest& black) {
  const RawDn& raw = picture.raw;
  if (const auto brief = check_bias_times(raw); !brief) return tl::make_unexpected(brief.error());
  calib::DarkRequest request = request_;
  request.is_bias = is_bias();
  if (const auto masked = isp::masked_black_of(picture).black) request.masked_dn = masked->pedestal_dn;
  if (const auto tag = isp::choose_black(raw, {isp::BlackChoice::metadata}); tag) {
    request.pedestal_dn = tag->pedestal_dn;
    if (picture.noise) request.noise = noise_model_of(raw, *picture.noise, tag->pedestal_dn);
  }
  auto dark = find_or_make(raw, request);
  if (!dark) return dark;
  if (request.is_bias) {
    const auto level = isp::choose_black_by_gain(picture, black);
    if (level && level->holds == BlackPoint::Holds::pedestal_and_dark) {
      dark = std::make_shared<const DarkFrame>(calib::at_masked_level(**dark, level->pedestal_dn));
    }
  } else if ((*dark)->masked_dn && (*dark)->masked_dn != request.masked_dn) {
    dark = std::make_shared<const DarkFrame>(calib::at_masked_level(**dark, *request.masked_dn));
  }
  if (request.masked_dn && (*dark)->holds_dark) {
    auto warning = calib::check_masked_level(raw, *request.masked_dn, **dark);
    if (!warning) return tl::make_unexpected(std::move(warning.error()));
    if (*warning) picture.warnings.push_back(*std::move(*warning));
  }
  if (const auto fits = calib::check_below_picture(raw, **dark); !fits) return tl::make_unexpected(fits.error());
  for (const MosaicTiff& master : files_.masters) picture.warnings.push_back(unchecked_text(master));
  return dark;
}

Result<void> DarkSource::adopt_masters(const RawDn& picture, const calib::FrameSetting& setting,
                                       const calib::DarkRequest& request) {
  if (files_.masters.empty() || master_setting_ == setting) return {};
  files_.groups.resize(raw_groups_);
  master_setting_.reset();
  for (const MosaicTiff& master : files_.masters) {
    auto group =
        calib::group_of_master(in_codes(master, picture), master.rounded, master.info, picture, request.pedestal_dn);
    if (!group) return tl::make_unexpected(with_file(group.error(), master.file));
    files_.groups.push_back(*std::move(group));
  }
  master_setting_ = setting;
  return {};
}

Result<void> DarkSource::check_bias_times(const RawDn& picture) const {
  constexpr double max_time = 0.1;  // largest fraction of the exposure time of the image
  for (std::size_t g = files_.darks; g < raw_groups_; ++g) {
    const auto& bias_s = files_.groups[g].setting.exposure_s;
    if (!bias_s || !picture.info.exposure_s || *bias_s <= max_time * *picture.info.exposure_s) continue;
    return fail(ErrorCode::invalid_argument,
                fmt::format("the exposure time of a bias frame is {:g} s, that of the image {:g} s; take bias frames "
                            "of the shortest time, or give darks with --dark-frame",
                            *bias_s, *picture.info.exposure_s));
  }
  return {};
}

void DarkSource::count_exposures(const RawDn& picture, calib::DarkRequest& request) const {
  request.estimated = !count_;
  request.exposures_per_file.assign(files_.groups.size(), 1);
  for (std::size_t g = 0; g < files_.groups.size(); ++g) {
    const calib::DarkGroup& group = files_.groups[g];
    const bool is_bias_group = g >= files_.darks && g < raw_groups_;
    const bool fits = group.mean_dn.width() == picture.active.width && group.mean_dn.height() == picture.active.height;
    if (count_ && !is_bias_group) {
      request.exposures_per_file[g] = *count_;
    } else if (group.frames == 1 && fits && request.noise) {
      request.exposures_per_file[g] = calib::estimate_exposures(group, picture, *request.noise, request.pedestal_dn);
    } else if (group.frames > 1 && fits && request.noise) {
      request.exposures_per_file[g] =
          calib::estimate_exposures_between(group, picture, *request.noise, request.pedestal_dn);
    }
  }
}

Result<std::shared_ptr<const DarkFrame>> DarkSource::find_or_make(const RawDn& picture, calib::DarkRequest& request) {
  const auto setting = calib::setting_of(picture);
  if (!setting) return tl::make_unexpected(setting.error());
  const std::lock_guard lock(mutex_);  // others that need the same frame wait for it
  if (auto adopted = adopt_masters(picture, *setting, request); !adopted) return tl::make_unexpected(adopted.error());
  count_exposures(picture, request);
  const Key key{*setting, request.masked_dn.has_value(), request.pedestal_dn, request.noise,
                request.exposures_per_file};
  auto found = std::ranges::find(made_, key, &Made::key);
  if (found == made_.end()) {
    Result<DarkFrame> made = calib::make_dark_frame(files_.groups, picture, request);
    if (!made) return tl::make_unexpected(std::move(made.error()));
    if (made_.size() == max_made) made_.pop_back();
    found = made_.insert(made_.end(), {key, std::make_shared<const DarkFrame>(*std::move(made))});
  }
  std::rotate(made_.begin(), found, found + 1);  // the most recently used comes first
  return made_.front().frame;
}

Result<bool> subtract_from_x_trans(DarkSource& darks, const isp::BlackRequest& black, RawFrame& mosaic) {
  const auto dark = darks.frame_for(mosaic, black);
  if (!dark) return tl::make_unexpected(dark.error());
  const auto level = isp::black_of(mosaic.raw, **dark);
  if (!level) return tl::make_unexpected(level.error());
  if (mosaic.noise) add_variance(**dark, isp::mean_range_dn(mosaic.raw, *level), *mosaic.noise);
  subtract(**dark, *level, mosaic.raw);
  std::ranges::copy((*dark)->unknown, std::back_inserter(mosaic.corrections.defects));
  std::ranges::copy((*dark)->warnings, std::back_inserter(mosaic.warnings));
  return true;
}

}  // namespace lowlux::cli
