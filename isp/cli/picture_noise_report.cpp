#include "isp/cli/picture_noise_report.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/black_report.h"
#include "isp/cli/estimate_text.h"
#include "isp/cli/lines.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {
namespace {

using Figures = std::vector<std::pair<const char*, std::string>>;

std::string black_text(const BlackPoint& black) {
  const auto& p = black.pedestal_dn;
  return fmt::format("{:.2f} {:.2f} {:.2f} {:.2f} DN{}", p[0], p[1], p[2], p[3],
                     black.holds == BlackPoint::Holds::pedestal_and_dark ? ", dark charge included" : "");
}

std::string agreement_text(const calib::NoiseAgreement& a) {
  return fmt::format("gain {:.4g} DN/e-, offset {:.4g} DN^2: ours are {:.3g} and {:.3g} times that, {}",
                     a.gain_dn_per_e, a.offset_dn2, a.gain_ratio, a.offset_ratio,
                     a.agrees ? "they agree" : "they disagree");
}

Figures figures_of(const calib::PictureNoise& n, const RawFrame& frame, const BlackPoint& black) {
  const double read_dn = std::sqrt(std::max(0.0, n.offset_dn2.value));
  Figures out{
      {"black", black_text(black)},
      {"system gain", text_of(n.gain_dn_per_e) + " DN/e-"},
      {"offset", fmt::format("{} DN^2: {:.3g} e- of noise without light", text_of(n.offset_dn2),
                             read_dn / n.gain_dn_per_e.value)},
      {"contrast", fmt::format("{:.2g} % of the light: sensitivities of the pixels, grain, fine texture",
                               100 * std::sqrt(n.contrast_squared))},
      {"fit",
       fmt::format("reduced chi square {:.3g}, {} degrees of freedom, {:.3g} % of the picture is flat, {:.4g} to "
                   "{:.4g} DN above black",
                   n.reduced_chi_square, n.degrees_of_freedom, 100 * n.flat_share, n.darkest_dn, n.brightest_dn)},
      {"codes",
       fmt::format("steps of {} DN, noise of {:.2g} steps in the dark", n.traces.code_step_dn, n.darkest_noise_steps)},
  };
  if (!frame.noise) {
    out.emplace_back("file's profile", "none");
    return out;
  }
  static constexpr const char* labels[] = {"file, red", "file, green", "file, blue"};
  const auto agreement = calib::compare_with(*frame.noise, n, isp::mean_range_dn(frame.raw, black));
  for (std::size_t k = 0; k < 3; ++k) out.emplace_back(labels[k], agreement_text(agreement[k]));
  return out;
}

}  // namespace

void show_picture_noise(const calib::PictureNoise& noise, const RawFrame& frame, const BlackPoint& black,
                        Calibration& found) {
  Lines out;
  const std::string name = name_of_gain(*calib::setting_of(frame.raw));
  isp::ReportSection section{name, "", {{"figure", "value"}, {}}, {}};
  for (const auto& [label, value] : figures_of(noise, frame, black)) {
    out.add(label, value);
    section.table.rows.push_back({label, value});
  }
  for (const std::string& reason : noise.reasons) section.text += reason + ". ";
  found.text += name + "\n" + out.text();
  found.report.sections.push_back(std::move(section));
}

}  // namespace lowlux::cli
