#include "isp/cli/calibrate/calibrate_noise.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer.h"
#include "calib/frame_setting.h"
#include "calib/profile/profile_use.h"
#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/cli/calibrate/black_report.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/calibrate/noise_report.h"
#include "isp/cli/shared/progress.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {
namespace {

/// Adds the frames of files to pairs, and checks that all are of the profile's camera.
Result<void> read_pairs(const std::vector<std::string>& files, const std::string& use, const CalibrateArgs& args,
                        Progress& progress, Calibration& found, FramePairs& pairs) {
  for (const std::string& file : files) {
    auto frame = read_calibration_frame(file, args);
    if (!frame) return tl::make_unexpected(frame.error());
    if (const auto same = put_camera(frame->raw.info, found.profile); !same) {
      return fail(same.error().code, same.error().message, file);
    }
    if (const auto same = put_mosaic(calib::mosaic_of(frame->raw), found.profile); !same) {
      return fail(same.error().code, same.error().message, file);
    }
    list_frame(file, use, frame->raw.info, found.frames);
    if (auto added = pairs.add(std::move(frame->raw), file); !added) return added;
    progress.advance(1, file);
  }
  return {};
}

/// Holds pairs of one gain setting, and their files.
struct GainPairs {
  std::vector<calib::PairStatistics> pairs;
  std::vector<std::string> files;
};

GainPairs of_iso(const std::vector<FramePair>& pairs, const std::optional<double>& iso) {
  GainPairs out;
  for (const FramePair& pair : pairs) {
    if (pair.statistics.setting.iso != iso) continue;
    out.pairs.push_back(pair.statistics);
    out.files.insert(out.files.end(), pair.files.begin(), pair.files.end());
  }
  return out;
}

Result<void> calibrate_gain(const GainPairs& darks, const GainPairs& flats, const CalibrateNoiseArgs& args,
                            Calibration& found) {
  const calib::FrameSetting& flat = flats.pairs.front().setting;
  const auto transfer = calib::fit_photon_transfer(darks.pairs, flats.pairs, {.steady_light = args.steady_light});
  if (!transfer) return fail(transfer.error().code, name_of_gain(flat) + ": " + transfer.error().message);
  std::vector<std::string> files = flats.files;
  files.insert(files.end(), darks.files.begin(), darks.files.end());
  const calib::FrameSetting& setting = darks.pairs.front().setting;
  GainProfile& gain = calib::gain_at(found.profile, setting);
  calib::put_photon_transfer(*transfer, setting, measured_today(std::move(files)), gain);
  show_photon_transfer(*transfer, darks.pairs, flats.pairs, found);
  return {};
}

std::vector<std::optional<double>> isos_of(const std::vector<FramePair>& pairs) {
  std::vector<std::optional<double>> out;
  out.reserve(pairs.size());
  for (const FramePair& p : pairs) out.push_back(p.statistics.setting.iso);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

Result<Calibration> calibrate_flats(const CalibrateNoiseArgs& args) {
  Progress progress(static_cast<int>(args.common.frames.size() + args.darks.size()), !args.common.quiet);
  Calibration found;
  auto profile = starting_profile(args.common);
  if (!profile) return tl::make_unexpected(profile.error());
  found.profile = std::move(*profile);
  FramePairs darks;
  auto read = read_pairs(args.darks, "dark", args.common, progress, found, darks);
  if (!read) return tl::make_unexpected(read.error());
  FramePairs flats(darks.pairs());
  read = read_pairs(args.common.frames, "flat", args.common, progress, found, flats);
  if (!read) return tl::make_unexpected(read.error());
  for (const FramePairs* pairs : {&darks, &flats}) {
    for (const std::string& file : pairs->alone()) {
      found.warnings.push_back(file + " is not used: there is no second flat of the same exposure time and level");
    }
  }
  found.report.title = camera_name(found.profile.make, found.profile.model) + ": photon transfer";
  if (flats.pairs().empty()) return fail(ErrorCode::insufficient, "no two flats form a pair; take two of each light");
  for (const auto& iso : isos_of(flats.pairs())) {
    const auto done = calibrate_gain(of_iso(darks.pairs(), iso), of_iso(flats.pairs(), iso), args, found);
    if (!done) return tl::make_unexpected(done.error());
  }
  return found;
}

Result<Calibration> calibrate_picture(const CalibrateNoiseArgs& args) {
  const std::string& file = args.common.frames.front();
  auto profile = starting_profile(args.common);
  if (!profile) return tl::make_unexpected(profile.error());
  const auto frame = read_calibration_frame(file, args.common);
  if (!frame) return tl::make_unexpected(frame.error());
  const auto at = [&file](const Error& error) { return fail(error.code, error.message, file); };
  const auto setting = calib::setting_of(frame->raw);
  if (!setting) return at(setting.error());
  const auto black = isp::choose_black(frame->raw, {.use_format_default = false});
  if (!black) return at(black.error());
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const auto noise =
      calib::fit_picture_noise(frame->raw, black->pedestal_dn,
                               {.method = args.method.value_or(calib::PictureNoiseMethod::ponomarenko)}, executor);
  if (!noise) {
    const bool is_of_image = noise.error().code == ErrorCode::insufficient;
    return fail(noise.error().code,
                noise.error().message +
                    (is_of_image ? "; use an image with smooth areas, dark and bright, or flats and --darks" : ""),
                file);
  }
  Calibration found;
  found.profile = std::move(*profile);
  found.report.title = camera_name(frame->raw.info.make, frame->raw.info.model) + ": noise of one picture";
  if (const auto same = put_camera(frame->raw.info, found.profile); !same) return at(same.error());
  if (const auto same = put_mosaic(calib::mosaic_of(frame->raw), found.profile); !same) return at(same.error());
  list_frame(file, "image", frame->raw.info, found.frames);
  for (const std::string& reason : noise->reasons) found.warnings.push_back(fmt::format("{}: {}", file, reason));
  calib::put_picture_noise(*noise, *black, *setting, measured_today({file}), calib::gain_at(found.profile, *setting));
  show_picture_noise(*noise, *frame, *black, found);
  return found;
}

}  // namespace

Result<Calibration> calibrate_noise(const CalibrateNoiseArgs& args) {
  if (const auto good = check_outputs(args.common); !good) return tl::make_unexpected(good.error());
  return args.darks.empty() ? calibrate_picture(args) : calibrate_flats(args);
}

int run_calibrate_noise(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_noise(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateNoiseArgs>(parsed);
  const auto found = calibrate_noise(args);
  return found ? finish(args.common, *found) : calibration_failed(args.common, found.error());
}

namespace {

constexpr double same_level = 0.02;  // relative to the light; a drift of more than 1 % is refused later
constexpr double same_level_dn = 0.5;
constexpr std::size_t max_waiting = 32;

}  // namespace

double FramePairs::black_dn(const std::optional<double>& iso) const {
  double sum = 0, n = 0;
  for (const FramePair& dark : darks_) {
    if (dark.statistics.setting.iso != iso) continue;
    for (const calib::SiteStatistics& site : dark.statistics.site) sum += site.mean_dn;
    n += static_cast<double>(dark.statistics.site.size());
  }
  return n > 0 ? sum / n : 0;
}

std::vector<FramePairs::Waiting>::iterator FramePairs::partner_of(const RawDn& frame, double mean_dn) {
  double nearest = std::max(same_level_dn, same_level * std::fabs(mean_dn - black_dn(frame.info.iso)));
  auto partner = waiting_.end();
  for (auto w = waiting_.begin(); w != waiting_.end(); ++w) {
    const FrameInfo& info = w->frame.info;
    if (info.iso != frame.info.iso || info.exposure_s != frame.info.exposure_s) continue;
    const double apart = std::fabs(w->mean_dn - mean_dn);
    if (apart > nearest) continue;
    nearest = apart;
    partner = w;
  }
  return partner;
}

Result<void> FramePairs::add(RawDn frame, const std::string& file) {
  const double mean = calib::mean_dn(frame);
  const auto partner = partner_of(frame, mean);
  if (partner == waiting_.end()) {
    if (waiting_.size() == max_waiting) {
      return fail(ErrorCode::insufficient,
                  fmt::format("{} frames are not used, because there is no second flat of the same exposure time and "
                              "level; take two of each light",
                              max_waiting),
                  file);
    }
    waiting_.push_back({std::move(frame), mean, file});
    return {};
  }
  auto pair = calib::measure_pair(partner->frame, frame);
  if (!pair) return fail(pair.error().code, pair.error().message, file);
  pairs_.push_back({std::move(*pair), {partner->file, file}});
  waiting_.erase(partner);
  return {};
}

std::vector<std::string> FramePairs::alone() const {
  std::vector<std::string> files;
  files.reserve(waiting_.size());
  for (const Waiting& w : waiting_) files.push_back(w.file);
  return files;
}

}  // namespace lowlux::cli
