#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/metrics/statistics.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/raw/measure/masked_black.h"

namespace lowlux::isp {
namespace {

constexpr int outer_px = 4, inner_px = 12, measured_px = 40;  // columns; the trims are those of measure_masked_black()
constexpr std::int64_t product_least = 500;                   // pixels per site that measure_masked_black() requires
constexpr double grey_e = 20;                                 // green of a grey that is developed to 18 % of white
constexpr Vector3 grey_of_green{0.5, 1, 0.7};                 // red and blue relative to green

PerSite<double> product_black_dn(const RawDn& raw) {
  const MaskedBlack measured = measure_masked_black(raw);
  return measured.black.value().pedestal_dn;  // cannot fail: the region is declared and large enough
}

struct Grey {
  Lab lab;
  UvPrime uv;
};

/// Returns the grey developed with black off by `error_e`: channels of a camera whose primaries are Rec. 709's.
Grey grey_with(const PerSite<double>& error_e) {
  static const Developing developing{
      rgb_to_xyz(primaries_rec709).value(),
      {grey_of_green[0] * grey_e / 0.18, grey_of_green[1] * grey_e / 0.18, grey_of_green[2] * grey_e / 0.18}};
  const Vector3 left{grey_of_green[0] * grey_e - error_e[0], grey_e - (error_e[1] + error_e[2]) / 2,
                     grey_of_green[2] * grey_e - error_e[3]};
  Vector3 camera{};
  for (std::size_t k = 0; k < 3; ++k) camera[k] = left[k] / developing.white_e[k];
  const auto xy = xy_of(xyz_of(developing.camera_to_xyz * camera));
  const auto uv = xy ? uv_prime_of(*xy) : std::nullopt;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {developed_lab(developing, left), uv.value_or(UvPrime{nan, nan})};
}

/// Errors of the black points of many frames.
struct BlackErrors {
  double rms_e = 0;      // over sites and seeds
  double ciede2000 = 0;  // CIEDE2000 of the grey, mean over the seeds
  double uv_shift = 0;   // rms
};

class BlackSums {
 public:
  void add(const DarkCase& dark, const PerSite<double>& measured_dn) {
    static const Grey truth = grey_with({});
    const double k = dark.sensor.system_gain_dn_per_e, black_dn = dark.sensor.black_level_dn + k * dark.dark_e;
    PerSite<double> error_e{};
    for (std::size_t site = 0; site < 4; ++site) {
      error_e[site] = (measured_dn[site] - black_dn) / k;
      square_e2_ += error_e[site] * error_e[site];
    }
    const Grey grey = grey_with(error_e);
    ciede2000_ += ciede2000(truth.lab, grey.lab);
    uv_square_ += std::pow(grey.uv.u - truth.uv.u, 2) + std::pow(grey.uv.v - truth.uv.v, 2);
    ++frames_;
  }
  BlackErrors errors() const {
    return {std::sqrt(square_e2_ / (4 * frames_)), ciede2000_ / frames_, std::sqrt(uv_square_ / frames_)};
  }

 private:
  double square_e2_ = 0, ciede2000_ = 0, uv_square_ = 0;
  double frames_ = 0;
};

/// A way to measure black, and its errors.
struct Way {
  std::string name;
  PerSite<double> (*measure)(const RawDn&);
  BlackSums sums{};
};

struct Amount {
  std::int64_t pixels;  // per site
  int seeds;
};

std::vector<Amount> amounts_of(bool quick) {
  if (quick) return {{100, 50}, {1000, 50}, {10'000, 10}};
  return {{100, 500}, {1000, 300}, {10'000, 100}, {100'000, 40}, {1'000'000, 8}};
}

std::vector<DarkCase> dark_cases() {
  SensorModel plain = bench_camera().model;
  plain.dsnu = plain.prnu = plain.row_noise_e = plain.column_noise_e = plain.hot_pixel_fraction = 0;
  SensorModel warm = plain, hot = plain;
  warm.read_noise_e = 4;
  hot.hot_pixel_fraction = 0.001;
  hot.hot_pixel_current_e_per_s = 200;
  return {{"2 e- dark", plain, 2}, {"200 e- dark, 4 e- read", warm, 200}, {"2 e- dark, 0.1 % hot", hot, 2}};
}

/// Measures one case: its levels with their times and errors.
class BlackCase {
 public:
  BlackCase(const DarkCase& dark, const BenchOptions& options) : dark_(dark), options_(options) {
    group_ = {dark.name, "rms error of the black point [e-]", {}};
  }

  void measure(StageRows& rows, std::vector<Finding>& findings, const AccuracyTiming& timing) {
    for (const Amount& amount : amounts_of(options_.quick)) add_amount(amount, findings);
    rows.add(group_, figures_, timing);
  }

 private:
  void add_amount(const Amount& amount, std::vector<Finding>& findings) {
    std::vector<Way> ways{{"mean", mean_black_dn}};
    if (amount.pixels >= product_least) ways.push_back({"masked black", product_black_dn});
    auto last = std::make_shared<RawDn>();
    for (int seed = 1; seed <= amount.seeds; ++seed) {
      *last = masked_frame(dark_, amount.pixels, static_cast<std::uint64_t>(seed));
      for (Way& way : ways) way.sums.add(dark_, way.measure(*last));
    }
    for (const Way& way : ways) {
      const BlackErrors errors = way.sums.errors();
      group_.levels.push_back({fmt::format("{}, {}", amount.pixels, way.name), errors.rms_e,
                               [measure = way.measure, last] { measure(*last); }, 1});
      figures_.push_back({black_error_e(dark_, amount.pixels), errors.ciede2000, errors.uv_shift, 1.0 * amount.seeds});
      if (dark_.sensor.hot_pixel_fraction == 0) findings.push_back(check(amount, way.name, errors.rms_e));
    }
  }

  /// Checks the ratio; the root of a mean of n squares of normal deviates has a relative standard error of sqrt(1 / (2
  /// n)).
  Finding check(const Amount& amount, const std::string& name, double rms_e) const {
    const double ratio = rms_e / black_error_e(dark_, amount.pixels);
    const double allowed = confidence_errors * std::sqrt(0.5 / (4 * amount.seeds));
    return check_of(
        fmt::format("black-point/{:g}-{}-{}", dark_.dark_e, amount.pixels, name == "mean" ? "mean" : "masked"),
        "the error is sqrt((d + sigma^2 + 1 / (12 K^2)) / M), to five standard errors",
        fmt::format("1 +- {:.2g}", allowed), fmt::format("{:.3g}", ratio), std::fabs(ratio - 1) <= allowed);
  }

  const DarkCase& dark_;
  const BenchOptions& options_;
  AccuracyGroup group_;
  std::vector<std::vector<double>> figures_;
};

}  // namespace

double black_error_e(const DarkCase& dark, std::int64_t pixels) {
  const SensorModel& s = dark.sensor;
  const double quantised_e2 = 1 / (12 * s.system_gain_dn_per_e * s.system_gain_dn_per_e);
  return std::sqrt((dark.dark_e + s.read_noise_e * s.read_noise_e + quantised_e2) / static_cast<double>(pixels));
}

RawDn masked_frame(const DarkCase& dark, std::int64_t pixels_per_site, std::uint64_t seed) {
  assert(pixels_per_site >= 100 && pixels_per_site % 20 == 0);
  EvenLight light{.sensor = dark.sensor, .exposure = {.time_s = 1, .temperature_c = 20}};
  light.sensor.dark_current_e_per_s.fill(dark.dark_e / light.exposure.time_s);
  light.width = 8;
  light.height = static_cast<int>(4 * pixels_per_site / measured_px);
  light.masked_columns = outer_px + measured_px + inner_px;
  light.seed = seed;
  InlineExecutor one;
  return even_frame(light, 0, one);
}

PerSite<double> mean_black_dn(const RawDn& raw) {
  PerSite<std::int64_t> sum{};
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* row = raw.dn.row(y) + outer_px;
    const auto site = static_cast<std::size_t>(site_of(0, y));
    for (int x = 0; x < measured_px; x += 2) {
      sum[site] += row[x];
      sum[site + 1] += row[x + 1];
    }
  }
  const double pixels = 0.25 * measured_px * raw.active.height;
  PerSite<double> out{};
  std::ranges::transform(sum, out.begin(), [&](std::int64_t s) { return static_cast<double>(s) / pixels; });
  return out;
}

Result<BenchOutcome> run_black_point_bench(const BenchOptions& options) {
  const AccuracyTiming timing{.rounds = options.quick ? 3 : 7, .min_s = 2e-3};  // some work takes microseconds
  StageRows rows{.further = {"closed form [e-]", "CIEDE2000 of a grey", "its u'v' shift", "frames"}};
  std::vector<Finding> findings;
  const std::vector<DarkCase> cases = dark_cases();
  for (const DarkCase& dark : cases) {
    BlackCase(dark, options).measure(rows, findings, timing);
    options.advance(1.0 / static_cast<double>(cases.size()), dark.name);
  }
  BenchOutcome out = outcome_of("black-point", rows, TimeOf::whole);
  out.findings = std::move(findings);
  out.remarks = {
      "The truth is the pedestal of the sensor plus the mean dark charge. Levels are numbers of pixels per site; their "
      "plain mean is compared with measure_masked_black(), which needs 500 pixels and excludes outliers. Errors are "
      "over the sites of this number of frames",
      "Times are those of one black point, not of a megapixel; memcpy copies a megapixel of floats",
      fmt::format("The grey has {:g} e- in green, {:g} and {:g} in red and blue, and is developed to 18 % of white. "
                  "Neither the truth nor the closed form includes hot pixels",
                  grey_e, grey_of_green[0] * grey_e, grey_of_green[2] * grey_e),
      timing_remark(timing, 1)};
  return out;
}

}  // namespace lowlux::isp
