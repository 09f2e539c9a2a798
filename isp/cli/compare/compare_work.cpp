#include "isp/cli/compare/compare_work.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/metrics/spectral_difference.h"

namespace lowlux::cli {
namespace {

Result<capture::ScenePicture> read(const std::string& file, Executor& executor) {
  auto picture = capture::read_picture(file, executor, {}, capture::Negatives::any);
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

using Json = nlohmann::ordered_json;

std::string difference_text(const isp::DifferenceSummary& d) {
  if (std::isnan(d.mean)) return "none: no pixel is finite in both";
  return fmt::format("mean {:.3f}, median {:.3f}, 95 % {:.3f}, largest {:.3f}", d.mean, d.median, d.percentile_95,
                     d.largest);
}

/// Returns the reason why the convex ratio is missing; empty if it exists.
std::string why_no_convex(const isp::GamutRatio& gamut) {
  return std::isnan(gamut.convex_percent) ? "the colours of A span no area" : "";
}

std::string convex_text(const isp::GamutRatio& gamut) {
  const std::string why = why_no_convex(gamut);
  return why.empty() ? fmt::format("{:.2f} %", gamut.convex_percent) : "none: " + why;
}

std::string occupancy_text(const isp::GamutRatio& gamut) {
  if (std::isnan(gamut.occupancy_percent)) return "none: no colour of A has enough pixels";
  return fmt::format("{:.2f} %, of {} bins of a*, b* in A and {} in B", gamut.occupancy_percent, gamut.reference_bins,
                     gamut.test_bins);
}

std::string spectra_text(const isp::SpectralDifference& d) {
  if (d.pixels == 0) return "none: no pixel has a chromaticity in both";
  return fmt::format("Kullback-Leibler {:.4g} nat, Jeffreys {:.4g} nat: smoothest spectra of {} pixels, mean",
                     d.kullback_leibler, d.jeffreys, d.pixels);
}

Json json_of(const isp::DifferenceSummary& d) {
  return {{"mean", d.mean}, {"median", d.median}, {"percentile_95", d.percentile_95}, {"largest", d.largest}};
}

Json egr_json(const CompareOutcome& outcome) {
  const isp::GamutRatio& gamut = outcome.found.gamut;
  const std::string why = why_no_convex(gamut);
  return {{"convex_percent", why.empty() ? Json(gamut.convex_percent) : Json(nullptr)},
          {"why_no_convex", why.empty() ? Json(nullptr) : Json(why)},
          {"occupancy_percent", gamut.occupancy_percent},
          {"bins_a", gamut.reference_bins},
          {"bins_b", gamut.test_bins}};
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

std::string compare_text(const CompareOutcome& outcome) {
  const isp::PictureComparison& c = outcome.found;
  Lines lines;
  lines.add("Delta E ab", difference_text(c.delta_e_ab));
  lines.add("Delta E 94c", difference_text(c.delta_e_94c));
  lines.add("CIEDE2000", difference_text(c.ciede2000));
  lines.add("EGR convex", convex_text(outcome.found.gamut));
  lines.add("EGR occupancy", occupancy_text(c.gamut));
  lines.add("spectra", spectra_text(outcome.spectra));
  lines.add("PSNR", std::isinf(c.psnr_db) ? "identical codes" : fmt::format("{:.3f} dB", c.psnr_db));
  lines.add("SSIM", c.ssim ? fmt::format("{:.5f}", *c.ssim)
                           : fmt::format("none: it needs {} x {} pixels", isp::ssim_window_px, isp::ssim_window_px));
  lines.add("pixels", fmt::format("{} x {}, of which {} are not finite", outcome.width, outcome.height, c.not_finite));
  lines.add("out of display",
            fmt::format("{} of A, {} of B: clipped for PSNR and SSIM", c.reference_outside, c.test_outside));
  if (c.reference_beyond + c.test_beyond > 0) {
    lines.add("out of EGR",
              fmt::format("{} of A, {} of B: a* or b* beyond {}", c.reference_beyond, c.test_beyond, isp::gamut_reach));
  }
  return lines.text();
}

std::string compare_json(const CompareArgs& args, const CompareOutcome& outcome) {
  const isp::PictureComparison& c = outcome.found;
  const Json json{{"a", args.reference},
                  {"b", args.test},
                  {"ok", true},
                  {"width", outcome.width},
                  {"height", outcome.height},
                  {"delta_e_ab", json_of(c.delta_e_ab)},
                  {"delta_e_94c", json_of(c.delta_e_94c)},
                  {"ciede2000", json_of(c.ciede2000)},
                  {"egr", egr_json(outcome)},
                  {"spectra",
                   {{"kullback_leibler_nat", outcome.spectra.kullback_leibler},
                    {"jeffreys_nat", outcome.spectra.jeffreys},
                    {"pixels", outcome.spectra.pixels}}},
                  {"identical_codes", std::isinf(c.psnr_db)},
                  {"psnr_db", c.psnr_db},  // null if infinite
                  {"ssim", c.ssim ? Json(*c.ssim) : Json(nullptr)},
                  {"not_finite", c.not_finite},
                  {"outside_display_a", c.reference_outside},
                  {"outside_display_b", c.test_outside},
                  {"beyond_gamut_a", c.reference_beyond},
                  {"beyond_gamut_b", c.test_beyond},
                  {"warnings", outcome.warnings}};
  return json_text(json, 2);
}

}  // namespace lowlux::cli
