#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/flat/flat_field.h"
#include "isp/base/frame.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/result.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/merge/merge_report.h"
#include "isp/cli/noise/noise_origin.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/plan/dark_charge.h"

namespace lowlux::cli {

/// Holds the outcome of one file of `develop`.
struct DevelopOutcome {
  std::string input;
  std::string output;
  std::optional<Error> error;                    // set: not all files were written
  std::optional<isp::DevelopPlan> plan;          // set without an error, unless skipped
  std::shared_ptr<const calib::FlatField> flat;  // set where the image was divided by flats
  std::optional<MergeReport> merged;             // set where several frames were merged first
  std::optional<NoiseOrigin> noise;              // set where it is known where the noise model comes from
  std::string clean_raw;                         // contents of the raw file that was written; empty for images
  bool skipped = false;                          // the outputs exist, and are kept
  int width = 0;                                 // width of the written image, upright
  int height = 0;
  std::vector<isp::StageTime> times;  // all stages, in order
};

/// Returns one JSON object.
std::string develop_json(const DevelopOutcome& outcome, const Defaults& defaults);
/// Returns the decisions for a frame, with reasons, as text. Precondition: outcome.plan.
std::string explain_text(const DevelopOutcome& outcome);
/// Returns stage times as text, one line for each and their sum.
std::string times_text(const std::vector<isp::StageTime>& times);

/// Returns the metadata of a raw file and values measured on it: text for people, or one JSON object.
/// @param noise  noise of the image as `develop` finds it; nullopt: none was found
std::string info_text(const std::string& file, const RawFrame& frame, const std::optional<NoiseOrigin>& noise);
std::string info_json(const std::string& file, const RawFrame& frame, const std::optional<NoiseOrigin>& noise);
std::string error_json(const std::string& file, const Error& error);

/// Returns "lowlux: FILE: what is wrong", one line.
std::string error_line(const std::string& file, const Error& error);

/// Returns an exposure time in photographers' notation: "1/60 s" below a quarter of a second, else with one decimal at
/// most, "5 s", "0.3 s" (the rule of ExifTool's PrintExposureTime).
std::string exposure_text(double exposure_s);

/// Returns "f/5.6"; below f/1 with two decimals.
std::string f_number_text(double f_number);

/// Returns the smallest, the median and the largest ratio of the blocks.
std::array<double, 3> ratio_range(const NoiseRatio& ratio);

/// Returns the range as text: "0.13 to 1 times this variance in blocks of 8 px, median 0.15".
std::string ratio_text(const NoiseRatio& ratio);

/// Returns "masked-pixels" and so on, the names in reports.
std::string_view name_of(BlackPoint::Source source);
std::string_view name_of(isp::DarkCharge::State state);

/// Returns "profile", "file" or "picture".
std::string_view name_of(NoiseProfile::Source source);

}  // namespace lowlux::cli
