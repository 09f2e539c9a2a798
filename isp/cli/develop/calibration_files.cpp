#include "isp/cli/develop/calibration_files.h"

#include "isp/cli/shared/raw_files.h"

namespace lowlux::cli {

Result<CalibrationFiles> calibration_files(const DevelopArgs& args, const std::vector<Job>& jobs) {
  Result<DarkNames> darks = dark_files(args, jobs);
  if (!darks) return tl::make_unexpected(darks.error());
  Result<std::vector<std::string>> flats = raw_files_of_lists(args.flats);
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

}  // namespace lowlux::cli
