#include <algorithm>
#include <cstdio>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/cli/exit_code.h"
#include "isp/cli/lines.h"
#include "isp/cli/output_place.h"
#include "isp/cli/outputs.h"
#include "isp/cli/report.h"
#include "isp/cli/resaturate_args.h"
#include "isp/cli/verbs.h"
#include "isp/cli/version.h"
#include "isp/output/image_writer.h"
#include "isp/pipeline/resaturate_picture.h"
#include "isp/render/output_space.h"

namespace lowlux::cli {
namespace {

struct Work {
  const ResaturateArgs& args;
  isp::FileFormat format;
  PictureKind kind;
};

struct Outcome {
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
                fmt::format("the picture is {} x {}, {} x {} pixels at ({}, {}) do not lie in it", xyz.width(),
                            xyz.height(), area.width, area.height, area.x, area.y),
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

void add_warnings(Outcome& out) {
  if (out.made.share_dark > 0.5) {
    out.warnings.push_back(fmt::format(
        "{:.0f} % of the picture is no brighter than the black point and becomes grey: is the black point too bright?",
        100 * out.made.share_dark));
  }
  if (out.made.share_saturated > 0.5) {
    out.warnings.push_back(
        fmt::format("{:.0f} % of the picture is saturated and stays as it is", 100 * out.made.share_saturated));
  }
}

Result<Outcome> worked(const Work& work, Executor& executor) {
  const ResaturateArgs& args = work.args;
  auto picture = capture::read_picture(args.input, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  Outcome out;
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
                                 .space = work.kind.space,
                                 .samples = work.kind.samples};
  out.made = isp::resaturate_picture(std::move(picture->xyz), options, executor);
  add_warnings(out);
  isp::WriteOptions write;
  write.overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  write.software = "lowlux " + version_number();
  write.jpeg.quality = args.jpeg_quality;
  write.exr.depth = args.bits.value_or(16) == 16 ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
  const auto written = isp::write_picture(out.made.picture, work.kind.space, {}, args.output, write, executor);
  if (!written) return fail(written.error().code, written.error().message, args.output);
  return out;
}

void print(const ResaturateArgs& args, const Outcome& done) {
  if (!args.quiet) {
    for (const std::string& warning : done.warnings) {
      fmt::print(stderr, "{}\n", one_line(fmt::format("lowlux: {}: warning: {}", args.input, warning)));
    }
  }
  const isp::Xyz& b = done.black;
  if (args.json) {
    const nlohmann::ordered_json json{{"file", args.input},
                                      {"ok", true},
                                      {"output", args.output},
                                      {"black_xyz", {b.x, b.y, b.z}},
                                      {"chroma_noise", done.made.chroma_noise},
                                      {"share_dark", done.made.share_dark},
                                      {"share_saturated", done.made.share_saturated},
                                      {"warnings", done.warnings}};
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  } else if (!args.quiet) {
    Lines lines;
    lines.add("black", fmt::format("X {:.5f}, Y {:.5f}, Z {:.5f} of white 1", b.x, b.y, b.z));
    lines.add("chroma noise", fmt::format("{:.5f} of white{}", done.made.chroma_noise,
                                          args.chroma_noise ? ", given" : ", measured on the picture"));
    lines.add("no brighter", fmt::format("{:.1f} % of the pixels: grey now", 100 * done.made.share_dark));
    lines.add("saturated", fmt::format("{:.1f} % of the pixels: as they were", 100 * done.made.share_saturated));
    fmt::print("{}\n{}", args.output, lines.text());
  }
}

int usage_error(const Error& error) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  fmt::print(stderr, "{}\n", one_line("lowlux resaturate: " + place + error.message));
  return exit_usage;
}

int failed(const ResaturateArgs& args, Error error) {
  if (error.where.empty()) error.where = args.input;
  fmt::print(stderr, "{}\n", error_line(args.input, error));
  if (args.json) fmt::print("{}\n", error_json(args.input, error));
  return exit_failed;
}

}  // namespace

int run_resaturate(const std::vector<std::string>& words) {
  const Parsed<ResaturateArgs> parsed = parse_resaturate(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<ResaturateArgs>(parsed);
  const Result<isp::FileFormat> format = isp::format_of(args.output);
  if (!format) return usage_error(format.error());
  const Result<PictureKind> kind = picture_kind(*format, args.bits, std::nullopt);
  if (!kind) return usage_error(kind.error());
  if (const std::string wrong = wrong_names({args.output}, {args.input}); !wrong.empty()) {
    return usage_error({ErrorCode::invalid_argument, wrong, "-o"});
  }
  if (const auto place = check_place(args.output, args.force); !place) return failed(args, place.error());
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const Result<Outcome> done = worked({args, *format, *kind}, executor);
  if (!done) return failed(args, done.error());
  print(args, *done);
  return exit_done;
}

}  // namespace lowlux::cli
