#include <chrono>
#include <cstddef>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/chart/spectral_colour.h"
#include "capture/file/spectra_file.h"
#include "isp/base/text.h"
#include "isp/cli/calibrate/calibrate_colour_work.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/scene_light.h"
#include "isp/model/vision/scotopic_fit.h"

namespace lowlux::cli {
namespace {

using Sensitivity = std::array<Spectrum, 3>;

Result<Sensitivity> sensitivity_of(const CalibrateColourArgs& args) {
  if (!args.camera.ends_with(".csv")) {
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
  if (!args.camera.ends_with(".csv")) out.model = args.camera;
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
