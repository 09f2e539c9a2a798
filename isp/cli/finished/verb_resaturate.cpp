#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/executor.h"
#include "isp/base/json_text.h"
#include "isp/cli/finished/picture_verb.h"
#include "isp/cli/finished/resaturate_args.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/pipeline/finished/resaturate_picture.h"
#include "isp/render/output_space.h"

namespace lowlux::cli {
namespace {

struct ResaturateOutcome {
  isp::Xyz black;
  isp::Resaturated made;
  std::vector<std::string> warnings;
};

isp::Xyz black_of_codes(const std::array<double, 3>& codes) {
  Vector3 linear{};
  for (std::size_t c = 0; c < 3; ++c) linear[c] = isp::decode_transfer(OutputSpace::srgb, codes[c] / 255);
  return isp::xyz_of(*isp::rgb_to_xyz(isp::primaries_rec709) * linear);
}

Result<isp::Xyz> black_of_area(const SceneLinear& xyz, const Rect& area) {
  if (area.x + area.width > xyz.width() || area.y + area.height > xyz.height()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the image has {} x {} pixels, and {} x {} pixels at ({}, {}) are not inside it",
                            xyz.width(), xyz.height(), area.width, area.height, area.x, area.y),
                "--black-area");
  }
  Vector3 sum{};
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) {
      for (std::size_t k = 0; k < 3; ++k) sum[k] += static_cast<double>(xyz.plane[k].at(x, y));
    }
  }
  const double pixels = static_cast<double>(area.width) * area.height;
  return isp::Xyz{sum[0] / pixels, sum[1] / pixels, sum[2] / pixels};
}

void add_warnings(ResaturateOutcome& out) {
  if (out.made.fraction_dark > 0.5) {
    out.warnings.push_back(fmt::format(
        "{:.0f} % of the image is not brighter than the black point and becomes grey: is the black point too bright?",
        100 * out.made.fraction_dark));
  }
  if (out.made.fraction_saturated > 0.5) {
    out.warnings.push_back(
        fmt::format("{:.0f} % of the image is saturated and not changed", 100 * out.made.fraction_saturated));
  }
}

PictureVerb verb_of(const ResaturateArgs& args) {
  return {"resaturate", {args.input}, args.output, args.bits,    args.jpeg_quality,
          args.force,   args.json,    args.quiet,  args.defaults};
}

Result<ResaturateOutcome> worked(const ResaturateArgs& args, const PictureKind& kind, Executor& executor) {
  auto picture = capture::read_picture(args.input, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  ResaturateOutcome out;
  out.warnings = picture->warnings;
  if (args.black_area) {
    const Result<isp::Xyz> black = black_of_area(picture->xyz, *args.black_area);
    if (!black) return tl::make_unexpected(black.error());
    out.black = *black;
  } else {
    out.black = black_of_codes(*args.black_codes);
  }
  isp::ResaturateOptions options{.black = out.black,
                                 .chroma_noise = args.chroma_noise,
                                 .prior_std = args.prior_std,
                                 .radius = args.radius,
                                 .space = kind.space,
                                 .samples = kind.samples};
  out.made = isp::resaturate_picture(std::move(picture->xyz), options, executor);
  add_warnings(out);
  const auto written = write_made(verb_of(args), out.made.picture, kind.space, *picture, executor);
  if (!written) return tl::make_unexpected(written.error());
  return out;
}

void print(const ResaturateArgs& args, const ResaturateOutcome& done) {
  const isp::Xyz& b = done.black;
  if (args.json) {
    const nlohmann::ordered_json json{{"file", args.input},
                                      {"ok", true},
                                      {"output", args.output},
                                      {"black_xyz", {b.x, b.y, b.z}},
                                      {"chroma_noise", done.made.chroma_noise},
                                      {"dark_fraction", done.made.fraction_dark},
                                      {"saturated_fraction", done.made.fraction_saturated},
                                      {"warnings", done.warnings}};
    print_out(fmt::format("{}\n", json_text(json, 2)));
  } else if (!args.quiet) {
    Lines lines;
    lines.add("black", fmt::format("X {:.5f}, Y {:.5f}, Z {:.5f} of white 1", b.x, b.y, b.z));
    lines.add("chroma noise", fmt::format("{:.5f} of white{}", done.made.chroma_noise,
                                          args.chroma_noise ? ", given" : ", measured on the image"));
    lines.add("at black", fmt::format("{:.1f} % of the pixels, set to grey", 100 * done.made.fraction_dark));
    lines.add("saturated", fmt::format("{:.1f} % of the pixels, unchanged", 100 * done.made.fraction_saturated));
    print_out(fmt::format("{}\n{}", one_line(args.output), lines.text()));
  }
}

}  // namespace

int run_resaturate(const std::vector<std::string>& words) {
  const Parsed<ResaturateArgs> parsed = parse_resaturate(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<ResaturateArgs>(parsed);
  return run_picture_verb(verb_of(args), [&args](const PictureKind& kind, Executor& executor) {
    return worked(args, kind, executor).map([&args](const ResaturateOutcome& done) {
      print(args, done);
      return done.warnings;
    });
  });
}

}  // namespace lowlux::cli
