#include "isp/cli/info/advise_bracket.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/executor.h"
#include "isp/base/json_text.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/model/sensor/exposure_advice.h"
#include "isp/pipeline/merge/bracket_scene.h"

namespace lowlux::cli {
namespace {

constexpr double default_snr_db = 20;     // ISO 12232: the ratio 10 of an image of acceptable quality
constexpr double default_clipped = 1e-5;  // lamps are small
constexpr double default_longest_s = 30;  // of cameras that time the exposure themselves
constexpr int max_command_frames = 5;     // that the command names one by one

isp::DevelopOptions measuring_options() {
  isp::DevelopOptions options;
  options.denoise.mode = isp::DenoiseChoice::Mode::automatic;
  options.denoise.always = true;
  return options;
}

Result<double> longest_exposure_s(const AdviseArgs& args, const RawFrame& frame) {
  if (!args.speed_px_per_s) {
    return args.longest_exposure_s.value_or(std::max(default_longest_s, frame.raw.info.exposure_s.value_or(0)));
  }
  auto limit = isp::motion_limit_s({*args.speed_px_per_s, *args.blur_px});
  if (!limit) return limit;
  return std::min(*limit, args.longest_exposure_s.value_or(*limit));
}

int count_of(const isp::BracketAdvice& advice) {
  int count = 0;
  for (const isp::BracketExposure& e : advice.exposures) count += e.frames;
  return count;
}

std::string headline(const BracketCase& found) {
  const int frames = count_of(found.advice);
  const std::string what =
      found.advice.is_bracket()
          ? fmt::format("bracket of {} exposures, {} frames", found.advice.exposures.size(), frames)
          : fmt::format("{} frame{} of {}", frames, frames == 1 ? "" : "s of equal exposure",
                        exposure_text(found.advice.exposures.front().exposure_s));
  return fmt::format("{}: merged SNR {:.1f} dB in the darkest tenth", what, isp::decibel(found.advice.snr));
}

std::string reason(const BracketCase& found) {
  const isp::BracketAdvice& a = found.advice;
  const std::string levels = fmt::format(
      "the brightest lamps saturate at {}; a single frame reaches {:.3g} dB in the darkest tenth at {}",
      exposure_text(a.highlight_exposure_s), isp::decibel(found.request.snr), exposure_text(a.shadow_exposure_s));
  if (a.is_bracket()) return "one exposure time is not sufficient for both: " + levels;
  if (a.shadow_exposure_s <= std::min(a.highlight_exposure_s, found.request.longest_exposure_s)) {
    return "one exposure time is sufficient for both: " + levels;
  }
  if (found.request.longest_exposure_s < a.highlight_exposure_s) {
    return fmt::format("exposures are at most {}, before highlights saturate: {}",
                       exposure_text(found.request.longest_exposure_s), levels);
  }
  return "a bracket does not need fewer frames: " + levels;
}

std::string exposures_text(const isp::BracketAdvice& advice, const FrameInfo& info) {
  std::string out;
  for (const isp::BracketExposure& e : advice.exposures) {
    out += fmt::format("{}{} x {}", out.empty() ? "" : ", ", e.frames, exposure_text(e.exposure_s));
  }
  if (info.iso) out += fmt::format(", at ISO {:g}", *info.iso);
  if (info.f_number) out += fmt::format(" and f/{:g}", *info.f_number);
  return out;
}

std::string scene_text(const isp::BracketScene& scene) {
  const double above_ev = std::log2(scene.highlight_fraction);
  std::string out = fmt::format("darkest tenth {:.3g} e- in {}; {:.3g} % of the pixels saturated", scene.darkest_e,
                                exposure_text(scene.exposure_s), 100 * scene.saturated_fraction);
  if (above_ev <= 0) return out + fmt::format(", brightest lamps {:.1f} EV below saturation", -above_ev);
  return out + fmt::format(", brightest lamps about {:.1f} EV above saturation (extrapolated)", above_ev);
}

std::string raw_text(const BracketCase& found) {
  const isp::BracketAdvice& a = found.advice;
  const bool saturated = found.request.scene.highlight_fraction > 1;
  return fmt::format("SNR {:.1f} dB; {:.0f} frame{} like this one would reach {:.3g} dB{}", isp::decibel(a.raw_snr),
                     a.frames_like_raw, a.frames_like_raw == 1 ? "" : "s", isp::decibel(found.request.snr),
                     saturated ? ", with saturated lamps" : "");
}

/// Returns the command that merges the frames, the longest exposure first: where frames do not match, the first one is
/// used alone, and the longest has the least noise.
std::string command_of(const isp::BracketAdvice& advice) {
  const int count = count_of(advice);
  std::string frames = "FRAME_1.dng";
  if (count > max_command_frames) {
    frames += fmt::format(" ... FRAME_{}.dng", count);
  } else {
    for (int i = 2; i <= count; ++i) frames += fmt::format(" FRAME_{}.dng", i);
  }
  return fmt::format("lowlux merge {} -o MERGED.dng", frames);
}

}  // namespace

Result<BracketCase> bracket_case(const AdviseArgs& args, RawFrame& frame) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64));
  const isp::DevelopOptions options = measuring_options();
  if (const auto noise = find_noise(options, {}, frame, executor); !noise) return tl::make_unexpected(noise.error());
  const auto scene =
      isp::measure_bracket_scene(frame, options, args.clipped_fraction.value_or(default_clipped), executor);
  if (!scene) return tl::make_unexpected(scene.error());
  const Result<double> longest_s = longest_exposure_s(args, frame);
  if (!longest_s) return tl::make_unexpected(longest_s.error());
  BracketCase out{.request = {.scene = *scene,
                              .snr = std::pow(10, args.snr_db.value_or(default_snr_db) / 10),
                              .longest_exposure_s = *longest_s},
                  .advice = {}};
  auto advice = isp::advise_bracket(out.request);
  if (!advice) return tl::make_unexpected(advice.error());
  out.advice = *std::move(advice);
  return out;
}

std::string bracket_text(const BracketCase& found, const FrameInfo& info) {
  Lines out;
  out.add("because", reason(found));
  out.add("exposures", exposures_text(found.advice, info));
  out.add("scene", scene_text(found.request.scene));
  out.add("this raw", raw_text(found));
  if (found.request.scene.darkest_is_black) {
    out.add("note",
            "the darkest tenth is not above black: the advice applies to the darkest level that this raw file shows");
  }
  if (found.request.scene.highlight_fraction > 1) {
    out.add("note", "take the shortest exposure first, and measure the lamps on it with `lowlux info --advise`");
  }
  if (count_of(found.advice) > 1) out.add("merge", command_of(found.advice));
  if (found.advice.is_bracket()) out.add("", "longest exposure first: the first frame is the reference");
  return fmt::format("advice           {}\n{}", headline(found), out.text());
}

std::string bracket_json(const BracketCase& found, const FrameInfo& info) {
  using Json = nlohmann::ordered_json;
  const auto& [request, advice] = found;
  const isp::BracketScene& scene = request.scene;
  Json exposures = Json::array();
  for (const isp::BracketExposure& e : advice.exposures) {
    exposures.push_back({{"exposure_s", e.exposure_s}, {"frames", e.frames}});
  }
  const Json json{{"bracket", advice.is_bracket()},
                  {"exposures", exposures},
                  {"iso", info.iso ? Json(*info.iso) : Json(nullptr)},
                  {"merged_snr_db", isp::decibel(advice.snr)},
                  {"requested_snr_db", isp::decibel(request.snr)},
                  {"raw_snr_db", isp::decibel(advice.raw_snr)},
                  {"frames_like_raw", advice.frames_like_raw},
                  {"reason", reason(found)},
                  {"highlight_exposure_s", advice.highlight_exposure_s},
                  {"shadow_exposure_s", advice.shadow_exposure_s},
                  {"longest_exposure_s", request.longest_exposure_s},
                  {"saturated_fraction", scene.saturated_fraction},
                  {"highlight_fraction", scene.highlight_fraction},
                  {"highlight_extrapolated", scene.highlight_fraction > 1},
                  {"darkest_e", scene.darkest_e},
                  {"darkest_is_black", scene.darkest_is_black},
                  {"dark_charge_e", scene.dark_charge_e},
                  {"noise_variance_e2", scene.noise_variance_e2},
                  {"command", command_of(advice)}};
  return json_text(json, 2);
}

}  // namespace lowlux::cli
