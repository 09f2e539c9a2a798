#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "capture/synthetic/photon_rows.h"
#include "capture/synthetic/scene.h"
#include "isp/base/random/random.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/count_laws.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {
namespace {

constexpr int width = 512;
constexpr std::uint64_t seed = 20261122;
constexpr double exact_bound = 0x1p-32;  // none of 2^32 words can be split, and the counts are rounded to the nearest

/// Amount of samples.
struct Size {
  int height;  // rows of `width` pixels in a round
  int rounds;
  std::size_t samples;  // for methods without a closed form
};

/// A white under D65, exposed so that green pixels expect `mean_e`.
struct Flat {
  explicit Flat(const SpectralResponse& response, int height)
      : scene(capture::flat_scene({width, height, light_named("D65").value(), "D65", 1}).value()),
        green_e_per_s(electron_rate(response, scene.white)[1]) {}

  capture::Scene scene;
  double green_e_per_s;
};

/// Returns sum x_i Qe_i^2 / sum x_i Qe_i - 1 in green: the relative error of the variance that Eq. 4.4 to 4.6 give.
double published_variance_error(const SpectralResponse& response, const Spectrum& radiance) {
  const Spectrum photons = photon_radiance(radiance).value();  // cannot fail for a radiance that is not negative
  const std::vector<double> widths = bin_widths_nm(photons);
  double mean = 0, variance = 0;
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const double efficiency = response.quantum_efficiency[1].at(photons.wavelengths_nm()[i]);
    mean += photons.values()[i] * widths[i] * efficiency;
    variance += photons.values()[i] * widths[i] * efficiency * efficiency;
  }
  return variance / mean - 1;
}

/// One light: the output of the levels, and the distributions.
class PhotonLight {
 public:
  PhotonLight(double mean_e, const Flat& flat, const capture::PhotonRows& photons, const Size& size)
      : mean_e_(mean_e),
        time_s_(mean_e / flat.green_e_per_s),
        photons_(photons),
        size_(size),
        law_(poisson_law(static_cast<double>(static_cast<float>(mean_e)))),  // samplers take floats
        means_(width, static_cast<float>(mean_e)),
        counts_(width) {}

  AccuracyGroup group() {
    const auto mean = static_cast<float>(mean_e_);
    const auto exact = law_of_words([mean](std::uint32_t r) { return poisson_of_word(r, mean); }, law_.size());
    const auto normal =
        law_of_words([mean](std::uint32_t r) { return rounded_normal_count(mean, normal_of_word(r)); }, law_.size());
    variance_errors_ = {variance_of_law(exact) / mean_e_ - 1, variance_of_law(normal) / mean_e_ - 1};
    const double megapixels = 1e-6 * width * size_.height;
    return {fmt::format("{:g} e-", mean_e_),
            "largest difference to the distribution function of Poisson",
            {{"poisson_row", kolmogorov_distance(exact, law_), [this] { draw_poisson(); }, megapixels},
             {"rounded normal", kolmogorov_distance(normal, law_), [this] { draw_normal(); }, megapixels},
             {"std::poisson", kolmogorov_distance(standard_sample(), law_), [this] { draw_standard(); }, megapixels},
             {"published", kolmogorov_distance(published_sample(), law_), [this] { draw_published(); }, megapixels}}};
  }
  const std::vector<double>& variance_errors() const { return variance_errors_; }

 private:
  void draw_poisson() {
    for (int y = 0; y < size_.height; ++y) poisson_row({seed, 0, 0}, 0, static_cast<std::uint32_t>(y), means_, counts_);
  }
  void draw_normal() {
    for (int y = 0; y < size_.height; ++y) {
      normal_row({seed, 0, 0}, 0, static_cast<std::uint32_t>(y), 1, counts_);
      std::ranges::transform(counts_, counts_.begin(),
                             [mean = means_[0]](float z) { return rounded_normal_count(mean, z); });
    }
  }
  void draw_standard() {
    std::poisson_distribution<int> poisson(mean_e_);
    for (int y = 0; y < size_.height; ++y) {
      std::ranges::generate(counts_, [&] { return static_cast<float>(poisson(sequence_)); });
    }
  }
  void draw_published() {
    for (int y = 0; y < size_.height; ++y) photons_.collect(seed, 0, 0, y, time_s_, counts_);
  }

  std::vector<float> standard_sample() {
    std::poisson_distribution<int> poisson(mean_e_);
    std::vector<float> sample(size_.samples);
    std::ranges::generate(sample, [&] { return static_cast<float>(poisson(sequence_)); });
    return sample;
  }
  /// Returns samples of green pixels.
  std::vector<float> published_sample() {
    std::vector<float> sample;
    sample.reserve(static_cast<std::size_t>(width) * size_.height / 2);
    for (int y = 0; y < size_.height; ++y) {
      photons_.collect(seed, 1, 0, y, time_s_, counts_);
      for (int x = 1 - (y & 1); x < width; x += 2) sample.push_back(counts_[x]);
    }
    return sample;
  }

  double mean_e_, time_s_;
  const capture::PhotonRows& photons_;
  Size size_;
  std::vector<double> law_;
  std::vector<float> means_, counts_;
  std::vector<double> variance_errors_;
  std::mt19937_64 sequence_{seed};
};

void add_findings(const std::string& light, std::span<const AccuracyRow> rows, const Size& size, BenchOutcome& out) {
  const auto error_of = [&](std::string_view level) {
    return std::ranges::find(rows, level, &AccuracyRow::level)->error;
  };
  const double ours = error_of("poisson_row"), standard = error_of("std::poisson");
  out.findings.push_back(check_of(
      fmt::format("photon-sampling/exact-{}", light), "poisson_row has the Poisson distribution to within 2^-32",
      fmt::format("< {:.3g}", exact_bound), fmt::format("{:.3g}", ours), ours < exact_bound));
  const double limit = kolmogorov_limit(size.samples);
  out.findings.push_back(check_of(fmt::format("photon-sampling/std-{}", light),
                                  "a sample of std::poisson_distribution agrees with the computed distribution",
                                  fmt::format("< {:.3g}", limit), fmt::format("{:.3g}", standard), standard < limit));
}

}  // namespace

Result<BenchOutcome> run_photon_sampling_bench(const BenchOptions& options) {
  const Size size = options.quick ? Size{64, 3, 100'000} : Size{512, 7, 2'000'000};
  const std::vector<double> means_e =
      options.quick ? std::vector<double>{0.1, 10, 1e4} : std::vector<double>{0.1, 1, 10, 100, 1e4};
  const AccuracyTiming timing{.rounds = size.rounds};
  const SpectralResponse response = bench_response();
  const Flat flat(response, size.height);
  const capture::PhotonRows photons(flat.scene, response, nullptr, BayerPhase::rggb, 0);
  const double published_error = published_variance_error(response, flat.scene.white);
  StageRows rows{.further = {"relative error of the variance"}};
  BenchOutcome found;
  for (const double mean_e : means_e) {
    PhotonLight light(mean_e, flat, photons, size);
    const AccuracyGroup group = light.group();
    rows.add(group, {{light.variance_errors()[0]}, {light.variance_errors()[1]}, {0}, {published_error}}, timing);
    add_findings(fmt::format("{:g}", mean_e), std::span(rows.rows).last(group.levels.size()), size, found);
    options.advance(1.0 / static_cast<double>(means_e.size()), group.name);
  }
  BenchOutcome out = outcome_of("photon-sampling", rows, TimeOf::megapixel);
  out.findings = std::move(found.findings);
  out.remarks = {
      "The reference is the Poisson distribution, summed in double precision. The distributions of poisson_row and of "
      "the rounded normal are exact counts over all 2^32 random words",
      fmt::format("std::poisson is a sample of {} counts of std::poisson_distribution; a sample of an exact "
                  "distribution differs by {:.2g} or less on average. The error of its variance is 0 by definition",
                  size.samples, 0.8687 / std::sqrt(static_cast<double>(size.samples))),
      fmt::format(
          "published draws photons by wavelength (D65, {}) and has fractions of electrons: a sample of {} green "
          "pixels; the error of its variance is the closed form sum x Qe^2 / sum x Qe - 1",
          bench_camera().camera, width * size.height / 2),
      timing_remark(timing, 1)};
  return out;
}

}  // namespace lowlux::isp
