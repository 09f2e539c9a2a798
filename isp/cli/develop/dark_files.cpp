#include "isp/cli/develop/dark_files.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_library.h"
#include "calib/dark/light_in_darks.h"
#include "capture/file/dng_source.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/raw/black_point.h"
#include "isp/raw/measure/masked_black.h"

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
              "the profile holds no measured doubling of the dark current; calibrate it with darks of two temperatures",
              file);
}

}  // namespace

Result<std::vector<std::string>> dark_files(const DevelopArgs& args, const std::vector<Job>& jobs) {
  auto found = raw_files_of_lists(args.dark.words);
  if (!found) return found;
  const std::vector<std::string>& files = *found;
  const bool black_asked = args.options.black.choice != isp::BlackChoice::automatic || !args.black_profile.empty();
  if (!files.empty() && black_asked) {
    return fail(ErrorCode::invalid_argument,
                "dark frames hold the black level already: taking both off leaves green shadows; give one of the two",
                "--black");
  }
  for (const Job& job : jobs) {
    const auto same = std::ranges::find_if(files, [&](const std::string& file) {
      std::error_code ignored;
      return fs::equivalent(job.input, file, ignored);
    });
    if (same == files.end()) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("{} is a picture and one of its darks", job.input),
                "--dark-frame");
  }
  return found;
}

Result<std::shared_ptr<DarkSource>> read_darks(const std::vector<std::string>& files, const DarkArgs& args) {
  calib::DarkLibrary library;
  for (const std::string& file : files) {
    const Result<RawFrame> frame = capture::read_raw(file);
    Result<void> added = frame ? library.add(frame->raw) : tl::make_unexpected(frame.error());
    if (!added) return tl::make_unexpected(with_file(added.error(), file));
  }
  std::vector<calib::DarkGroup> groups = library.groups();
  calib::DarkRequest request{.noise_fraction = args.noise_fraction, .doubling_c = args.doubling_c};
  if (!args.doubling_profile.empty()) {
    const Result<double> doubling = doubling_of_profile(args.doubling_profile, groups.front().setting);
    if (!doubling) return tl::make_unexpected(doubling.error());
    request.doubling_c = *doubling;
  }
  return std::make_shared<DarkSource>(std::move(groups), request);
}

Result<std::shared_ptr<const DarkFrame>> DarkSource::frame_for(RawFrame& picture) {
  const RawDn& raw = picture.raw;
  calib::DarkRequest request = request_;
  if (const auto masked = isp::measure_masked_black(raw).black) request.masked_dn = masked->pedestal_dn;
  if (const auto tag = isp::choose_black(raw, {isp::BlackChoice::metadata}); tag) {
    request.pedestal_dn = tag->pedestal_dn;
  }
  const auto setting = calib::setting_of(raw);
  if (!setting) return tl::make_unexpected(setting.error());
  auto dark = make_or_find(raw, {*setting, request.masked_dn.has_value(), request.pedestal_dn}, request);
  if (!dark) return dark;
  if ((*dark)->masked_dn && (*dark)->masked_dn != request.masked_dn) {
    dark = std::make_shared<const DarkFrame>(calib::at_masked_level(**dark, *request.masked_dn));
  }
  if (request.masked_dn) {
    auto warning = calib::check_masked_level(raw, *request.masked_dn, **dark);
    if (!warning) return tl::make_unexpected(std::move(warning.error()));
    if (*warning) picture.warnings.push_back(*std::move(*warning));
  }
  if (const auto fits = calib::check_below_picture(raw, **dark); !fits) return tl::make_unexpected(fits.error());
  return dark;
}

Result<std::shared_ptr<const DarkFrame>> DarkSource::make_or_find(const RawDn& picture, const Key& key,
                                                                  const calib::DarkRequest& request) {
  const std::lock_guard lock(mutex_);  // others that need the same frame wait for it
  auto found = std::ranges::find(made_, key, &Made::key);
  if (found == made_.end()) {
    Result<DarkFrame> made = calib::make_dark_frame(groups_, picture, request);
    if (!made) return tl::make_unexpected(std::move(made.error()));
    if (made_.size() == max_made) made_.pop_back();
    found = made_.insert(made_.end(), {key, std::make_shared<const DarkFrame>(*std::move(made))});
  }
  std::rotate(made_.begin(), found, found + 1);  // the most recently used comes first
  return made_.front().frame;
}

}  // namespace lowlux::cli
