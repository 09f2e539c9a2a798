#include "isp/cli/compare/compare_work.h"

#include <algorithm>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "isp/cli/shared/exit_code.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/metrics/spectral_difference.h"

namespace lowlux::cli {
namespace {

Result<capture::ScenePicture> read(const std::string& file, Executor& executor) {
  auto picture = capture::read_picture(file, executor);
  if (!picture) return fail(picture.error().code, picture.error().message, file);
  return picture;
}

void add_warnings(const capture::ScenePicture& picture, const std::string& file, CompareOutcome& out) {
  for (const std::string& warning : picture.warnings) out.warnings.push_back(fmt::format("{}: {}", file, warning));
}

/// Warns if the files state different whites in cd/m2; the comparison is relative to each white.
void warn_of_whites(const capture::ScenePicture& a, const capture::ScenePicture& b, CompareOutcome& out) {
  if (!a.absolute || !b.absolute || a.white_luminance_cd_m2 == b.white_luminance_cd_m2) return;
  out.warnings.push_back(fmt::format("white is {:g} cd/m2 in A and {:g} in B: each is compared relative to its own",
                                     a.white_luminance_cd_m2, b.white_luminance_cd_m2));
}

}  // namespace

Result<CompareOutcome> compare_scenes(const capture::ScenePicture& reference, const capture::ScenePicture& test,
                                      const CompareArgs& args, Executor& executor) {
  CompareOutcome out;
  add_warnings(reference, args.reference, out);
  add_warnings(test, args.test, out);
  out.width = reference.xyz.width();
  out.height = reference.xyz.height();
  if (test.xyz.width() != out.width || test.xyz.height() != out.height) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} x {} pixels, but {} has {} x {}: crop or scale one of them to the size of the other",
                            test.xyz.width(), test.xyz.height(), args.reference, out.width, out.height),
                args.test);
  }
  warn_of_whites(reference, test, out);
  out.spectra = isp::spectral_difference(reference.xyz, test.xyz, executor);
  out.found = isp::compare_pictures(reference.xyz, test.xyz, executor);
  return out;
}

Result<CompareOutcome> compare_files(const CompareArgs& args) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const auto reference = read(args.reference, executor);
  if (!reference) return tl::make_unexpected(reference.error());
  const auto test = read(args.test, executor);
  if (!test) return tl::make_unexpected(test.error());
  return compare_scenes(*reference, *test, args, executor);
}

}  // namespace lowlux::cli
