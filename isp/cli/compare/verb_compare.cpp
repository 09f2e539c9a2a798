#include <algorithm>
#include <cstdio>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/cli/compare/compare_args.h"
#include "isp/cli/compare/compare_report.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/metrics/picture_comparison.h"

namespace lowlux::cli {
namespace {

Result<capture::ScenePicture> read(const std::string& file, Executor& executor, CompareOutcome& out) {
  auto picture = capture::read_picture(file, executor);
  if (!picture) {
    Error error = picture.error();
    error.where = file;
    return tl::make_unexpected(error);
  }
  for (const std::string& warning : picture->warnings) out.warnings.push_back(fmt::format("{}: {}", file, warning));
  return picture;
}

/// Warns if the files state different whites in cd/m2; the comparison is relative to each white.
void warn_of_whites(const capture::ScenePicture& a, const capture::ScenePicture& b, CompareOutcome& out) {
  if (!a.absolute || !b.absolute || a.white_luminance_cd_m2 == b.white_luminance_cd_m2) return;
  out.warnings.push_back(fmt::format("white is {:g} cd/m2 in A and {:g} in B: each is compared relative to its own",
                                     a.white_luminance_cd_m2, b.white_luminance_cd_m2));
}

Result<CompareOutcome> compared(const CompareArgs& args) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  CompareOutcome out;
  const auto a = read(args.reference, executor, out);
  if (!a) return tl::make_unexpected(a.error());
  const auto b = read(args.test, executor, out);
  if (!b) return tl::make_unexpected(b.error());
  out.width = a->xyz.width();
  out.height = a->xyz.height();
  if (b->xyz.width() != out.width || b->xyz.height() != out.height) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} x {} pixels, but {} has {} x {}: crop or scale one of them to the size of the other",
                            b->xyz.width(), b->xyz.height(), args.reference, out.width, out.height),
                args.test);
  }
  warn_of_whites(*a, *b, out);
  out.spectra = isp::spectral_difference(a->xyz, b->xyz, executor);
  out.found = isp::compare_pictures(a->xyz, b->xyz, executor);
  return out;
}

}  // namespace

int run_compare(const std::vector<std::string>& words) {
  const Parsed<CompareArgs> parsed = parse_compare(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CompareArgs>(parsed);
  const Result<CompareOutcome> done = compared(args);
  if (!done) {
    const Error& error = done.error();
    if (args.json) print_out(fmt::format("{}\n", error_json(error.where, error)));
    return print_failure(error);
  }
  for (const std::string& warning : done->warnings) {
    print_err(fmt::format("{}\n", one_line("lowlux compare: warning: " + warning)));
  }
  if (args.json) {
    print_out(fmt::format("{}\n", compare_json(args, *done)));
  } else {
    print_out(fmt::format("{} against {}\n{}", one_line(args.test), one_line(args.reference), compare_text(*done)));
  }
  return exit_done;
}

}  // namespace lowlux::cli
