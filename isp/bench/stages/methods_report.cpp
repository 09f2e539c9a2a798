#include "isp/bench/stages/methods_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/accuracy_time.h"

namespace lowlux::isp {
namespace {

constexpr int part_px = 256;
constexpr const char* stage = "methods";

std::string image_id(const std::string& method) {
  std::string out = fmt::format("{}-{}", stage, method);
  std::ranges::replace_if(
      out, [](char c) { return c == '.' || c == '_'; }, '-');
  return out;
}

std::vector<Plot> plots_of(std::span<const MethodRow> rows) {
  std::vector<AccuracyRow> timed;
  for (const MethodRow& row : rows) {
    if (!std::isfinite(row.ms_per_mp)) continue;
    timed.push_back({.group = row.light + " e-",
                     .error_of = "mean CIEDE2000 against the truth",
                     .level = row.method,
                     .error = row.score.error.ciede2000,
                     .ms_per_mp = row.ms_per_mp,
                     .undominated = row.undominated});
  }
  return accuracy_plots(stage, timed);
}

/// Adds each method's part, compared with the noisy one.
void add_parts(std::vector<MethodPart> parts, BenchOutcome& out) {
  for (MethodPart& part : parts) {
    std::string id = image_id(part.method);
    while (std::ranges::find(out.images, id, &BenchImage::id) != out.images.end()) id += "-2";
    if (part.method != name_of_noisy) {
      out.comparisons.push_back({part.method, image_id(name_of_noisy), name_of_noisy, id, part.method});
    }
    out.images.push_back({std::move(id), std::move(part.codes)});
  }
}

std::string joined(std::span<const MethodScene> scenes) {
  std::string out;
  for (const MethodScene& scene : scenes) {
    const SceneLinear& image = scene.picture.linear;
    out += fmt::format("{}{} {} x {}", out.empty() ? "" : ", ", scene.picture.name, image.width(), image.height());
  }
  return out;
}

}  // namespace

Encoded8 middle_codes(const SceneLinear& display) {
  const int width = std::min(part_px, display.width()), height = std::min(part_px, display.height());
  const int x0 = (display.width() - width) / 2, y0 = (display.height() - height) / 2;
  RgbView<const float> part;
  for (std::size_t c = 0; c < 3; ++c) part[c] = display.plane[c].view().crop(x0, y0, width, height);
  return codes_of(part);
}

std::vector<DenoiseLight> methods_lights(bool quick) {
  constexpr DenoiseLight bright{200, 2, 1.5}, dim{20, 2, 1.5}, dark{4, 2, 1.5};
  if (quick) return {dim};
  return {bright, dim, dark};
}

BenchOutcome methods_outcome(std::span<const MethodRow> rows, std::vector<MethodPart> parts) {
  BenchOutcome out{.table = methods_table(rows), .plots = plots_of(rows)};
  add_parts(std::move(parts), out);
  out.remarks = {
      "Every method is given the same raw frames, alone in a private folder; the truth stays in the memory of lowlux",
      "Rows are means over the scenes. The rank is that of PSNR; noise-free is the mosaic without noise, noisy the "
      "input. Raw output is rendered as that of lowlux; an image is scaled to the mean luminance of the truth first",
      "saturation, texture and stars kept are slopes against the truth: 1 is all of it. chroma bias is the length of "
      "the "
      "mean difference in a*, b*; blotches are the RMS difference in a*, b* of means over 16 x 16 pixels",
      "Times are by the wall clock, one run for each frame: a program's includes its start and reading and writing "
      "files; a function's does not. Peak memory is that of the largest process of a program"};
  return out;
}

std::vector<BenchSetting> methods_settings(const BenchOptions& options, std::span<const MethodScene> scenes,
                                           std::span<const DenoiseLight> lights) {
  std::vector<BenchSetting> out{
      {"seed", fmt::format("{}", options.seed)},
      {"pictures", fmt::format("{}{}", name_of(options.pictures), options.quick ? ", quick" : "")},
      {"scenes", joined(scenes)},
      {"sensor", fmt::format("RGGB, 16 bits, white balance gains {:g}, {:g}, {:g}, black level with dark charge, "
                             "NoiseProfile stated",
                             bench_white_gain[0], bench_white_gain[1], bench_white_gain[2])}};
  for (const DenoiseLight& light : lights) {
    out.push_back({fmt::format("light {}", name_of(light)),
                   fmt::format("mean signal {:g} e-, dark charge {:g} e-, read noise {:g} e-", light.mean_e,
                               light.dark_e, light.read_noise_e)});
  }
  out.push_back({"limits", fmt::format("{:g} s, {} MiB of a file, {} MiB of memory", options.command_limits.max_wall_s,
                                       options.command_limits.max_file_bytes >> 20,
                                       options.command_limits.max_memory_bytes >> 20)});
  for (const ScoredMethod& method : options.methods) {
    out.push_back({"method " + method.name, method.command.empty() ? "a function of Python" : method.command});
  }
  return out;
}

}  // namespace lowlux::isp
