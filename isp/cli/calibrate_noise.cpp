#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "calib/pair_statistics.h"
#include "calib/photon_transfer.h"
#include "isp/base/executor.h"
#include "isp/cli/calibration.h"
#include "isp/cli/noise_report.h"
#include "isp/cli/picture_noise_report.h"
#include "isp/cli/progress.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {
namespace {

constexpr double same_level = 0.01;       // relative to the code: frames of one light
constexpr std::size_t most_waiting = 32;  // frames without a partner, kept in memory

double mean_dn(const RawDn& raw) {
  double sum = 0;
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = 0; x < raw.active.width; ++x) sum += row[x];
  }
  return sum / (static_cast<double>(raw.active.width) * raw.active.height);
}

/// Frames become pairs as they come: each waits for one of its setting and level.
class Pairing {
 public:
  Result<void> add(RawDn frame, const std::string& file) {
    const double mean = mean_dn(frame);
    const auto partner = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& w) {
      return w.frame.info.iso == frame.info.iso && w.frame.info.exposure_s == frame.info.exposure_s &&
             std::fabs(w.mean - mean) <= same_level * mean;
    });
    if (partner == waiting_.end()) {
      if (waiting_.size() == most_waiting) {
        return fail(
            ErrorCode::insufficient,
            fmt::format("{} frames found no partner of the same exposure time and level; take two of each light",
                        most_waiting),
            file);
      }
      waiting_.push_back({std::move(frame), mean, file});
      return {};
    }
    auto pair = calib::measure_pair(partner->frame, frame);
    if (!pair) return fail(pair.error().code, pair.error().message, file);
    pairs.push_back(std::move(*pair));
    waiting_.erase(partner);
    return {};
  }

  std::vector<std::string> alone() const {
    std::vector<std::string> files;
    for (const Waiting& w : waiting_) files.push_back(w.file);
    return files;
  }

  std::vector<calib::PairStatistics> pairs;

 private:
  struct Waiting {
    RawDn frame;
    double mean;
    std::string file;
  };
  std::vector<Waiting> waiting_;
};

Result<Pairing> pairs_of(const std::vector<std::string>& files, const CalibrateArgs& args, Progress& progress,
                         FrameInfo& camera) {
  Pairing out;
  for (const std::string& file : files) {
    auto frame = read_calibration_frame(file, args);
    if (!frame) return tl::make_unexpected(frame.error());
    camera = frame->raw.info;
    if (const auto added = out.add(std::move(frame->raw), file); !added) return tl::make_unexpected(added.error());
    progress.advance(1, file);
  }
  return out;
}

std::vector<calib::PairStatistics> of_iso(const std::vector<calib::PairStatistics>& pairs,
                                          const std::optional<double>& iso) {
  std::vector<calib::PairStatistics> out;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(out),
               [&](const calib::PairStatistics& p) { return p.setting.iso == iso; });
  return out;
}

Result<void> calibrate_gain(const std::optional<double>& iso, const Pairing& darks, const Pairing& flats,
                            const CalibrateNoiseArgs& args, Calibration& found) {
  const auto own_darks = of_iso(darks.pairs, iso), own_flats = of_iso(flats.pairs, iso);
  const std::string name = iso ? fmt::format("ISO {:g}: ", *iso) : "";
  const auto transfer = calib::fit_photon_transfer(own_darks, own_flats, {.steady_light = args.steady_light});
  if (!transfer) return fail(transfer.error().code, name + transfer.error().message);
  std::vector<std::string> files = args.common.frames;
  files.insert(files.end(), args.darks.begin(), args.darks.end());
  const calib::FrameSetting& setting = own_darks.front().setting;
  GainProfile& gain = calib::gain_at(found.profile, setting);
  calib::put_photon_transfer(*transfer, setting, measured_today(std::move(files)), gain);
  show_photon_transfer(*transfer, own_darks, own_flats, found);
  return {};
}

std::vector<std::optional<double>> isos_of(const std::vector<calib::PairStatistics>& pairs) {
  std::vector<std::optional<double>> out;
  for (const calib::PairStatistics& p : pairs) out.push_back(p.setting.iso);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

Result<Calibration> calibrate_flats(const CalibrateNoiseArgs& args) {
  Progress progress(static_cast<int>(args.common.frames.size() + args.darks.size()), !args.common.quiet);
  Calibration found;
  FrameInfo camera;
  auto profile = starting_profile(args.common);
  if (!profile) return tl::make_unexpected(profile.error());
  found.profile = std::move(*profile);
  const auto darks = pairs_of(args.darks, args.common, progress, camera);
  if (!darks) return tl::make_unexpected(darks.error());
  const auto flats = pairs_of(args.common.frames, args.common, progress, camera);
  if (!flats) return tl::make_unexpected(flats.error());
  if (const auto same = put_camera(camera, found.profile); !same) return tl::make_unexpected(same.error());
  for (const Pairing* pairing : {&*darks, &*flats}) {
    for (const std::string& file : pairing->alone()) {
      found.warnings.push_back(file + " has no partner of the same exposure time and level: it is not used");
    }
  }
  found.report.title = fmt::format("{} {}: photon transfer", camera.make, camera.model);
  if (flats->pairs.empty()) return fail(ErrorCode::insufficient, "no two flats make a pair; take two of each light");
  for (const auto& iso : isos_of(flats->pairs)) {
    const auto done = calibrate_gain(iso, *darks, *flats, args, found);
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
  const auto black = isp::choose_black(frame->raw, {});
  if (!black) return at(black.error());
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const auto noise = calib::fit_picture_noise(frame->raw, black->pedestal_dn, {.method = args.method}, executor);
  if (!noise) return at(noise.error());
  Calibration found;
  found.profile = std::move(*profile);
  found.report.title = fmt::format("{} {}: noise of one picture", frame->raw.info.make, frame->raw.info.model);
  if (const auto same = put_camera(frame->raw.info, found.profile); !same) return at(same.error());
  for (const std::string& reason : noise->reasons) found.warnings.push_back(file + ": " + reason);
  calib::put_picture_noise(*noise, *black, *setting, measured_today({file}), calib::gain_at(found.profile, *setting));
  show_picture_noise(*noise, *frame, *black, found);
  return found;
}

}  // namespace

int run_calibrate_noise(const std::vector<std::string>& words) {
  const auto parsed = parse_calibrate_noise(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CalibrateNoiseArgs>(parsed);
  if (const auto good = check_outputs(args.common); !good) return calibration_failed(good.error());
  const auto found = args.darks.empty() ? calibrate_picture(args) : calibrate_flats(args);
  return found ? finish(args.common, *found) : calibration_failed(found.error());
}

}  // namespace lowlux::cli
