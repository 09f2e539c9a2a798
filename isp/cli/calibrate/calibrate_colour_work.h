#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/chart/chart_finder.h"
#include "calib/chart/chart_patches.h"
#include "calib/chart/colour_fit.h"
#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::cli {

/// Holds one matrix's result for a patch; without `lab` only the difference is known.
struct PatchError {
  double ciede2000 = 0;
  std::optional<isp::Lab> lab;
};

/// Holds a matrix's errors over the chart; nullopt for patches that could not be measured.
struct MatrixErrors {
  std::string name;  // a single word, used as column name
  std::string what;
  std::vector<std::optional<PatchError>> patches;
};

/// Holds a chart as it was found and measured.
struct MeasuredChart {
  calib::ChartPicture picture;
  calib::FoundChart found;
  calib::LightGradient light;
  Vector3 neutral{1, 1, 1};             // camera RGB of the grey row
  std::optional<double> neutral_cct_k;  // by the file's own matrix
};

/// Holds the results of `calibrate colour`.
struct ColourOutcome {
  std::string input;
  std::string make, model;
  ColourProfile colour;
  std::string illuminant_reason;
  std::array<isp::Lab, 24> reference{};
  std::vector<MatrixErrors> matrices;  // the last, apart from cross-validation, is the profile's
  std::optional<MeasuredChart> chart;
  std::vector<std::string> warnings;
};

/// Returns mean, median and maximum over the patches that have a value.
calib::ErrorSummary summary_of(const MatrixErrors& errors);

/// Calibrates from a photographed chart. Errors: those of capture::read_raw, calib::find_chart and calib::fit_colour; a
/// frame that is not a Bayer mosaic; an unknown illuminant; OpenCV's module cannot be loaded.
Result<ColourOutcome> colour_from_chart(const CalibrateColourArgs& args, Executor& executor);

/// Calibrates from spectral sensitivities. Errors: an unknown camera (near matches are offered), a table without three
/// columns, those of calib::spectral_colour.
Result<ColourOutcome> colour_from_spectra(const CalibrateColourArgs& args);

/// Returns the program, the source files and the date of the values.
Provenance provenance_of(const std::string& file);

}  // namespace lowlux::cli
