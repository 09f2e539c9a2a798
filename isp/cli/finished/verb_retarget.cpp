#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/executor.h"
#include "isp/base/json_text.h"
#include "isp/cli/finished/picture_verb.h"
#include "isp/cli/finished/retarget_args.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/picture_options.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/pipeline/finished/retarget_picture.h"

namespace lowlux::cli {
namespace {

struct RetargetOutcome {
  std::string coefficients;
  isp::RetargetedPicture made;
  std::vector<std::string> warnings;
};

PictureVerb verb_of(const RetargetArgs& args) {
  PictureVerb verb{"retarget", {args.input}, args.output, args.bits,    args.jpeg_quality,
                   args.force, args.json,    args.quiet,  args.defaults};
  if (!args.coefficients.empty()) verb.inputs.push_back(args.coefficients);
  return verb;
}

Result<RetargetOutcome> worked(const RetargetArgs& args, const PictureKind& kind, Executor& executor) {
  isp::RetargetOptions options = args.options;
  Result<isp::ShinTable> table = isp::shin_substitute();
  if (!args.coefficients.empty()) {
    table = read_shin_file(args.coefficients);
    if (!table) return tl::make_unexpected(table.error());
    options.shin = &*table;
  }
  auto picture = capture::read_picture(args.input, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  auto made = isp::retarget_picture(picture->xyz, options, kind.samples, executor);
  if (!made) return tl::make_unexpected(made.error());
  const auto written = write_made(verb_of(args), made->picture, kind.space, *picture, executor);
  if (!written) return tl::make_unexpected(written.error());
  return RetargetOutcome{isp::coefficients_name(options), std::move(*made), picture->warnings};
}

void print_json(const RetargetArgs& args, const RetargetOutcome& done) {
  const isp::RetargetOptions& o = args.options;
  nlohmann::ordered_json json{{"file", args.input},
                              {"ok", true},
                              {"output", args.output},
                              {"model", isp::name_of(o.method)},
                              {"coefficients", done.coefficients},
                              {"units", o.units == isp::ShinUnits::lux ? "lux" : "luminance"},
                              {"source_cd_m2", o.source_cd_m2},
                              {"display_cd_m2", o.display_cd_m2},
                              {"display_black_cd_m2", o.display_black_cd_m2},
                              {"fraction_beyond_gamut", done.made.fraction_outside_gamut},
                              {"table_levels", done.made.levels},
                              {"table_mean_ciede2000", done.made.error.mean_ciede2000},
                              {"table_max_ciede2000", done.made.error.max_ciede2000},
                              {"warnings", done.warnings}};
  if (done.coefficients.empty()) {
    json["coefficients"] = nullptr;
    json["units"] = nullptr;
  }
  print_out(fmt::format("{}\n", json_text(json, 2)));
}

void print_retargeted(const RetargetArgs& args, const RetargetOutcome& done) {
  const isp::RetargetOptions& o = args.options;
  Lines lines;
  lines.add("luminance",
            fmt::format("{:g} to {:g} cd/m2, black {:g}", o.source_cd_m2, o.display_cd_m2, o.display_black_cd_m2));
  lines.add("model", isp::name_of(o.method));
  if (!done.coefficients.empty()) {
    lines.add("coefficients", fmt::format("{}, by {}", done.coefficients,
                                          o.units == isp::ShinUnits::lux ? "the lux on white" : "luminance"));
  }
  lines.add("beyond gamut", fmt::format("{:.1f} % of the pixels: nearest colour of the display",
                                        100 * done.made.fraction_outside_gamut));
  lines.add("table", fmt::format("{0} x {0} x {0}, error {1:.2f} CIEDE2000 on average, {2:.1f} at most",
                                 done.made.levels, done.made.error.mean_ciede2000, done.made.error.max_ciede2000));
  print_out(fmt::format("{}\n{}", one_line(args.output), lines.text()));
}

}  // namespace

int run_retarget(const std::vector<std::string>& words) {
  const Parsed<RetargetArgs> parsed = parse_retarget(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<RetargetArgs>(parsed);
  return run_picture_verb(verb_of(args), [&args](const PictureKind& kind, Executor& executor) {
    return worked(args, kind, executor).map([&args](const RetargetOutcome& done) {
      if (args.json) {
        print_json(args, done);
      } else if (!args.quiet) {
        print_retargeted(args, done);
      }
      return done.warnings;
    });
  });
}

}  // namespace lowlux::cli
