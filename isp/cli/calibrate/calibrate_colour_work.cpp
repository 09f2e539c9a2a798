#include "isp/cli/calibrate/calibrate_colour_work.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/chart/spectral_colour.h"
#include "capture/file/dng_source.h"
#include "capture/file/spectra_file.h"
#include "isp/base/file_extension.h"
#include "isp/base/text.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/scene_light.h"
#include "isp/model/vision/scotopic_fit.h"
#include "isp/raw/black_point.h"
#include "isp/raw/corrections.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

using calib::ColourFit;
using calib::ColourSample;

Result<calib::ChartPicture> picture_of(const RawFrame& frame, Executor& executor) {
  if (frame.raw.layout != SensorLayout::bayer) {
    return fail(ErrorCode::unsupported, "a chart is measured on a Bayer mosaic, but the file is not one");
  }
  const auto black = isp::choose_black(frame.raw, {.use_format_default = false});
  if (!black) return tl::make_unexpected(black.error());
  SignalFraction mosaic = isp::subtract_dark(isp::to_fraction(frame.raw, *black, executor));
  isp::apply_gains(frame.corrections, mosaic.value.view(), executor);
  return calib::chart_picture(mosaic, frame.raw);
}

Result<MeasuredChart> measured_chart(const RawFrame& frame, Executor& executor) {
  auto picture = picture_of(frame, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  const auto detect = load_chart_detector();
  if (!detect) return tl::make_unexpected(detect.error());
  auto found = calib::find_chart(*picture, *detect);
  if (!found) return tl::make_unexpected(found.error());
  return MeasuredChart{*std::move(picture), *std::move(found), {}, {1, 1, 1}, {}};
}

struct Light {
  std::string name;
  std::string reason;
  Spectrum spectrum;
  isp::Xyz white;
};

Result<Light> light_from(const std::string& name, const std::string& reason) {
  auto spectrum = light_of(name, "--illuminant");
  if (!spectrum) return tl::make_unexpected(spectrum.error());
  const isp::Xyz sum = isp::xyz_of(*spectrum);
  if (!(sum.y > 0)) return fail(ErrorCode::insufficient, "the light has no luminance", name);
  return Light{name, reason, *std::move(spectrum), {sum.x / sum.y, 1, sum.z / sum.y}};
}

/// Returns the requested illuminant; by default, because the matrix is valid for the light of the chart, the nearest of
/// the illuminants that matrices are published for.
Result<Light> choose_light(const CalibrateColourArgs& args, const std::optional<double>& cct_k) {
  if (!args.illuminant.empty()) return light_from(args.illuminant, "as asked");
  if (!cct_k) return light_from("D50", "the file has no matrix to estimate the light with");
  std::string nearest;
  double distance = HUGE_VAL;
  for (const char* name : {"A", "D50", "D55", "D65", "D75"}) {
    const auto temperature = isp::colour_temperature_of(*isp::xy_of(isp::xyz_of(*isp::light_named(name))));
    const double apart = std::fabs(1 / temperature->cct_k - 1 / *cct_k);
    if (apart >= distance) continue;
    distance = apart;
    nearest = name;
  }
  return light_from(nearest, fmt::format("nearest to the grey patches, {:.0f} K by the matrix of the file", *cct_k));
}

/// Returns the errors of the usable patches at their positions among all patches.
MatrixErrors errors_of(std::string name, std::string what, const MeasuredChart& chart,
                       const std::vector<double>& ciede2000, const std::vector<isp::Lab>& lab) {
  MatrixErrors out{std::move(name), std::move(what), std::vector<std::optional<PatchError>>(24)};
  std::size_t next = 0;
  for (std::size_t i = 0; i < out.patches.size(); ++i) {
    if (!calib::usable(chart.found.patches[i])) continue;
    out.patches[i] = PatchError{ciede2000[next], lab.empty() ? std::nullopt : std::optional(lab[next])};
    ++next;
  }
  return out;
}

/// Performs one calibration from start to end.
class ChartCalibration {
 public:
  ChartCalibration(const CalibrateColourArgs& args, const RawFrame& frame, MeasuredChart chart)
      : args_(args), frame_(frame), chart_(std::move(chart)) {}

  Result<ColourOutcome> run() {
    if (auto light = find_light(); !light) return tl::make_unexpected(light.error());
    if (auto done = fit(); !done) return tl::make_unexpected(done.error());
    if (auto done = fill_profile(); !done) return tl::make_unexpected(done.error());
    describe();
    out_.chart = std::move(chart_);
    return std::move(out_);
  }

 private:
  Result<void> find_light() {
    const auto neutral = calib::chart_neutral(chart_.found.patches, {});
    if (!neutral) return fail(ErrorCode::insufficient, "the grey row of the chart cannot be measured: is it clipped?");
    chart_.neutral = *neutral;
    if (const auto white = isp::white_of_neutral(frame_.colour, *neutral)) chart_.neutral_cct_k = white->cct_k;
    auto light = choose_light(args_, chart_.neutral_cct_k);
    if (!light) return tl::make_unexpected(light.error());
    light_ = *std::move(light);
    const auto reference = calib::chart_reference(light_->spectrum);
    if (!reference) return tl::make_unexpected(reference.error());
    for (std::size_t i = 0; i < 24; ++i) out_.reference[i] = isp::lab_of((*reference)[i], light_->white);
    samples_ = calib::samples_of(chart_.found.patches, *reference);
    options_.white = light_->white;
    options_.uneven_light = !args_.even_light;
    return {};
  }

  Result<void> fit() {
    auto fitted = calib::fit_colour(samples_, options_);
    if (!fitted) return tl::make_unexpected(fitted.error());
    chart_.light = fitted->light;
    chart_.neutral = calib::chart_neutral(chart_.found.patches, fitted->light).value_or(chart_.neutral);
    if (args_.preserve_white) {
      options_.neutral = chart_.neutral;
      fitted = calib::fit_colour(samples_, options_);
      if (!fitted) return tl::make_unexpected(fitted.error());
      chart_.light = fitted->light;
    }
    fit_ = *fitted;
    if (const auto as_shot = as_shot_white()) add_before("as-shot", "file's matrix, as-shot white", *as_shot);
    if (const auto white = isp::white_of_neutral(frame_.colour, chart_.neutral)) {
      add_before("before", "file's matrix, white by the chart", white->xy);
    }
    add("after", "fitted matrix", fit_);
    const auto left_out = calib::cross_validated(samples_, options_);
    if (!left_out) return tl::make_unexpected(left_out.error());
    out_.matrices.push_back(errors_of("left-out", "matrix fitted to the other patches", chart_, *left_out, {}));
    return {};
  }

  std::optional<isp::Xy> as_shot_white() const {
    if (frame_.colour.as_shot_white_xy) {
      return isp::Xy{(*frame_.colour.as_shot_white_xy)[0], (*frame_.colour.as_shot_white_xy)[1]};
    }
    if (!frame_.colour.as_shot_neutral) return std::nullopt;
    const auto white = isp::white_of_neutral(frame_.colour, *frame_.colour.as_shot_neutral);
    return white ? std::optional(white->xy) : std::nullopt;
  }

  void add(const char* name, const char* what, const ColourFit& matrix) {
    std::vector<isp::Lab> lab(samples_.size());
    std::transform(samples_.begin(), samples_.end(), lab.begin(), [&](const ColourSample& sample) {
      return isp::lab_of(calib::predicted(matrix, sample), light_->white);
    });
    const auto errors = calib::colour_errors(matrix, samples_, light_->white);
    out_.matrices.push_back(errors_of(name, what, chart_, errors, lab));
  }

  void add_before(const char* name, const char* what, const isp::Xy& scene_white) {
    const auto matrix = isp::camera_to_xyz(frame_.colour, scene_white, *isp::xy_of(light_->white));
    const auto scaled = matrix ? calib::scaled_to_chart(*matrix, samples_, options_)
                               : Result<ColourFit>(tl::make_unexpected(matrix.error()));
    if (scaled) {
      add(name, what, *scaled);
    } else {
      out_.warnings.push_back(fmt::format("{}: {}", what, scaled.error().message));
    }
  }

  Result<void> fill_profile() {
    const auto calibration = calib::calibration_of(fit_, light_->white);
    if (!calibration) return tl::make_unexpected(calibration.error());
    out_.colour.calibration = *calibration;
    out_.colour.illuminant = light_->name;
    for (const MatrixErrors& errors : out_.matrices) {
      if (errors.name == "after") out_.colour.patches_ciede2000 = summary_of(errors).mean;
      if (errors.name == "left-out") out_.colour.cross_validated_ciede2000 = summary_of(errors).mean;
    }
    out_.colour.condition_number = fit_.condition_number;
    out_.colour.provenance = provenance_of(args_.chart);
    return {};
  }

  void describe() {
    out_.input = args_.chart;
    out_.make = frame_.raw.info.make;
    out_.model = frame_.raw.info.model;
    out_.illuminant_reason = light_->reason;
    out_.warnings.insert(out_.warnings.end(), frame_.warnings.begin(), frame_.warnings.end());
    for (std::size_t i = 0; i < 24; ++i) {
      if (calib::usable(chart_.found.patches[i])) continue;
      out_.warnings.push_back(fmt::format("patch {} is not used: {:.1f} % of it are clipped, {} pixels are left", i + 1,
                                          100 * chart_.found.patches[i].clipped_fraction,
                                          chart_.found.patches[i].pixels));
    }
  }

  const CalibrateColourArgs& args_;
  const RawFrame& frame_;
  MeasuredChart chart_;
  std::optional<Light> light_;
  std::vector<ColourSample> samples_;
  calib::ColourFitOptions options_;
  ColourFit fit_{};
  ColourOutcome out_;
};

using Sensitivity = std::array<Spectrum, 3>;

Result<Sensitivity> sensitivity_of(const CalibrateColourArgs& args) {
  if (!has_extension(args.camera, ".csv")) {
    if (args.per_photon) {
      return fail(ErrorCode::invalid_argument, "the cameras of the table are per unit of power", "--per-photon");
    }
    if (auto known = isp::camera_sensitivity(args.camera)) return *std::move(known);
    const auto near = near_matches(args.camera, isp::camera_names());
    return fail(ErrorCode::invalid_argument,
                fmt::format("no spectral sensitivities of '{}' are known; {}", args.camera,
                            near.empty() ? "`lowlux simulate --list` names the cameras, FILE.csv gives your own"
                                         : fmt::format("near it: {}", fmt::join(near, ", "))),
                "--camera");
  }
  auto table = capture::read_spectra(args.camera);
  if (!table) return tl::make_unexpected(table.error());
  if (table->size() != 3) {
    return fail(ErrorCode::malformed,
                fmt::format("sensitivities must be three spectra, of R, G and B; the table has {}", table->size()),
                args.camera);
  }
  const auto per_power = [&](std::size_t i) {
    const Spectrum& spectrum = (*table)[i].spectrum;
    return args.per_photon ? spectrum.mapped([](double nm, double value) { return value * nm / 550; }) : spectrum;
  };
  return Sensitivity{per_power(0), per_power(1), per_power(2)};
}

MatrixErrors errors_of(const char* name, const char* what, const calib::RatedMatrix& matrix, const isp::Xyz& white) {
  MatrixErrors out{name, what, {}};
  out.patches.reserve(matrix.ciede2000.size());
  for (std::size_t i = 0; i < matrix.ciede2000.size(); ++i) {
    out.patches.emplace_back(PatchError{matrix.ciede2000[i], isp::lab_of(matrix.patch_xyz[i], white)});
  }
  return out;
}

}  // namespace

Result<ColourOutcome> colour_from_chart(const CalibrateColourArgs& args, Executor& executor) {
  const auto frame = capture::read_raw(args.chart);
  if (!frame) return tl::make_unexpected(frame.error());
  auto chart = measured_chart(*frame, executor);
  if (!chart) return tl::make_unexpected(chart.error());
  return ChartCalibration(args, *frame, *std::move(chart)).run();
}

Result<ColourOutcome> colour_from_spectra(const CalibrateColourArgs& args) {
  const auto sensitivity = sensitivity_of(args);
  if (!sensitivity) return tl::make_unexpected(sensitivity.error());
  const std::string light_name = args.illuminant.empty() ? "D50" : args.illuminant;
  const auto light = light_of(light_name, "--illuminant");
  if (!light) return tl::make_unexpected(light.error());
  const auto colour = calib::spectral_colour(*sensitivity, *light);
  if (!colour) return fail(colour.error().code, colour.error().message, args.camera);

  ColourOutcome out;
  out.input = args.camera;
  if (!has_extension(args.camera, ".csv")) out.model = args.camera;
  out.illuminant_reason = args.illuminant.empty() ? "the default" : "as asked";
  for (std::size_t i = 0; i < 24; ++i) out.reference[i] = isp::lab_of(colour->reference[i], colour->white);
  out.matrices = {errors_of("printed", "Eq. 4.14 as printed", colour->printed, colour->white),
                  errors_of("corrected", "Eq. 4.14 per unit of power", colour->corrected, colour->white),
                  errors_of("fitted", "least squares on training reflectances", colour->fitted, colour->white)};
  out.colour.illuminant = light_name;
  out.colour.calibration = colour->calibration;
  out.colour.patches_ciede2000 = colour->training_ciede2000;
  out.colour.cross_validated_ciede2000 = summary_of(out.matrices.back()).mean;
  out.colour.condition_number = colour->corrected.condition_number;
  if (isp::light_of_spectrum(light_name, *light)) {  // S/P is within the supported range
    const auto rods = isp::fit_scotopic(*sensitivity, *light, isp::pigment_reflectances());
    if (rods) out.colour.scotopic_weights = rods->weights;
  }
  out.colour.provenance = provenance_of(args.camera);
  return out;
}

calib::ErrorSummary summary_of(const MatrixErrors& errors) {
  std::vector<double> known;
  known.reserve(errors.patches.size());
  for (const auto& patch : errors.patches) {
    if (patch) known.push_back(patch->ciede2000);
  }
  return calib::summary_of(std::move(known));
}

Provenance provenance_of(const std::string& file) {
  Provenance out;
  out.figures = "colour matrix";
  out.source = "lowlux " + version_number();
  out.date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::chrono::system_clock::now()));
  out.files = {file};
  return out;
}

}  // namespace lowlux::cli
