#include "isp/cli/develop/calibration_files.h"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_stack.h"
#include "calib/frame_setting.h"
#include "capture/file/dng_source.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {
namespace {

/// Adds a flat to the stack, and its levels to the sums.
Result<void> add_flat(const std::string& file, calib::DarkStack& stack, calib::FlatLevels& levels,
                      std::optional<double>& f_number) {
  const Result<RawFrame> frame = capture::read_raw(file);
  if (!frame) return tl::make_unexpected(frame.error());
  if (auto added = stack.add(frame->raw); !added) return added;
  const auto black = isp::choose_black(frame->raw, {});
  if (!black) return tl::make_unexpected(black.error());
  for (int site = 0; site < 4; ++site) levels.black_dn[site] += black->pedestal_dn[site];
  if (stack.frames() > 1) return {};
  f_number = frame->raw.info.f_number;
  if (frame->noise) levels.noise = noise_model_of(frame->raw, *frame->noise, black->pedestal_dn);
  return {};
}

}  // namespace

Result<CalibrationFiles> calibration_files(const DevelopArgs& args, const std::vector<Job>& jobs) {
  Result<DarkNames> darks = dark_files(args, jobs);
  if (!darks) return tl::make_unexpected(darks.error());
  Result<std::vector<std::string>> flats = raw_files_of_lists(args.flats, args.quiet);
  if (!flats) return tl::make_unexpected(flats.error());
  if (auto apart = check_no_picture(jobs, *flats, "--flat-frame", "flats"); !apart) {
    return tl::make_unexpected(apart.error());
  }
  std::vector<std::string> only_read = darks->all();
  only_read.insert(only_read.end(), flats->begin(), flats->end());
  only_read.insert(only_read.end(), {args.profile, args.black_profile, args.dark.doubling_profile,
                                     args.look.coefficients, args.look.light_file});
  if (args.merge) {
    for (const Job& job : jobs) only_read.push_back(job.input);
  }
  if (auto unharmed = check_unharmed(jobs, only_read); !unharmed) return tl::make_unexpected(unharmed.error());
  return CalibrationFiles{*std::move(darks), *std::move(flats)};
}

Result<std::shared_ptr<const calib::FlatField>> read_flats(const std::vector<std::string>& files) {
  calib::DarkStack stack(calib::StackedFrames::flats);
  calib::FlatLevels levels;
  std::optional<double> f_number;
  for (const std::string& file : files) {
    const auto added = add_flat(file, stack, levels, f_number);
    if (!added) return tl::make_unexpected(with_file(added.error(), file));
  }
  for (double& black_dn : levels.black_dn) black_dn /= stack.frames();
  auto flat = calib::make_flat_field(stack.average(), levels);
  if (!flat) return tl::make_unexpected(with_file(flat.error(), files.front()));
  flat->f_number = f_number;
  return std::make_shared<const calib::FlatField>(*std::move(flat));
}

Result<void> use_flat(const calib::FlatField& flat, RawFrame& picture) {
  const auto setting = calib::setting_of(picture.raw);
  if (!setting) return tl::make_unexpected(setting.error());
  calib::FrameSetting of_flats = flat.setting;
  of_flats.iso = setting->iso;  // neither vignetting nor response depends on the gain
  if (auto same = calib::check_same_camera(*setting, of_flats, "the flat frame"); !same) {
    same.error().message += "; the first frame is the image: take flats with the same camera and image size";
    return same;
  }
  const auto& f_number = picture.raw.info.f_number;
  if (f_number && flat.f_number && *f_number != *flat.f_number) {
    picture.warnings.push_back(fmt::format(
        "the flats were taken at f/{:g}, the image at f/{:g}: the vignetting may differ", *flat.f_number, *f_number));
  }
  RawCorrections& corrections = picture.corrections;
  if (!corrections.gain_maps.empty() || !corrections.radial_gains.empty()) {
    picture.warnings.emplace_back("the flats replace the gain maps of the file, which correct the same vignetting");
  }
  corrections.gain_maps.assign(1, flat.gain);
  corrections.radial_gains.clear();
  return {};
}

}  // namespace lowlux::cli
