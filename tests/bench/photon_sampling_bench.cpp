// What accuracy costs in time, for the first step of a simulation: electrons drawn as physics has it (one Poisson draw
// for each pixel) beside electrons drawn wavelength by wavelength as the thesis publishes it. Both read out the same
// frames in turn, memcpy of a frame between them; errors are those of the frames that were timed.
//   photon_sampling_bench [--rounds N, at least 5]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "capture/synthetic/synthetic_source.h"
#include "isp/base/random/random_rows.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace {

using namespace lowlux;

constexpr int width = 600, height = 400;
constexpr double pixels = width * height;

double cpu_clock_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

capture::Scene flat() {
  return *capture::flat_scene({width, height, *isp::light_named("HPS_generic"), "HPS_generic", 1});
}

capture::Scene picture() {
  SceneLinear xyz(width, height);
  const Vector3 sand{0.45, 0.42, 0.25};
  for (int c = 0; c < 3; ++c) std::fill_n(xyz.plane[c].data(), xyz.plane[c].size(), static_cast<float>(sand[c]));
  return *capture::picture_scene(std::move(xyz), 1);
}

/// One way to draw electrons: its times, and its frames' statistics in green against those of a Poisson law.
struct Way {
  std::string name;
  capture::SyntheticSource source;
  std::vector<double> ms{};
  double mean_ratio = 0;
  double variance_ratio = 0;

  double median_ms() const {
    std::vector<double> sorted = ms;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
};

Way way(const char* name, capture::Scene scene, capture::PhotonSampling sampling) {
  InlineExecutor executor;
  isp::SensorFigures figures;
  figures.read_noise_e = 0;
  figures.row_noise_e = 0;
  const isp::NamedSensor sensor = *isp::sensor_named("ELD_NikonD850", "ISO 1600", figures);
  capture::SyntheticOptions options;
  options.sampling = sampling;
  options.effects = {std::nullopt, {isp::Effect::photon_noise}};
  return {name, *capture::SyntheticSource::of(std::move(scene), sensor, *isp::spectral_response(sensor, {}), options,
                                              executor)};
}

void measure(Way& way, const Plane<float>& dn, double gain_dn_per_e, double black_dn) {
  double sum = 0, square = 0, rate = 0, count = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 1 - y % 2; x < width; x += 2) {  // green of rggb
      const double e = (dn.at(x, y) - black_dn) / gain_dn_per_e;
      sum += e;
      square += e * e;
      rate += way.source.light().e_per_s.at(x, y);
      ++count;
    }
  }
  const double mean = sum / count, expected = rate / count;
  way.mean_ratio = mean / expected;
  way.variance_ratio = (square / count - mean * mean) / expected;
}

int rounds_of(int argc, char** argv) {
  int rounds = 5;
  if (argc == 3 && std::strcmp(argv[1], "--rounds") == 0) rounds = std::atoi(argv[2]);
  return std::max(rounds, 5);
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = rounds_of(argc, argv);
  std::vector<Way> ways;
  ways.push_back(way("physical, a spectrum", flat(), capture::PhotonSampling::physical));
  ways.push_back(way("published, a spectrum", flat(), capture::PhotonSampling::published));
  ways.push_back(way("physical, a colour", picture(), capture::PhotonSampling::physical));
  ways.push_back(way("published, a colour", picture(), capture::PhotonSampling::published));
  const isp::NamedSensor sensor = *isp::sensor_named("ELD_NikonD850", "ISO 1600", {});
  InlineExecutor executor;
  Plane<float> copied(width, height);
  std::vector<double> copy_ms;
  for (int round = -1; round < rounds; ++round) {  // one to warm up
    for (Way& w : ways) {
      const double start = cpu_clock_ms();
      const Plane<float> dn = w.source.frame_dn(static_cast<std::uint32_t>(round + 1), executor);
      const double read = cpu_clock_ms();
      std::memcpy(copied.data(), dn.data(), dn.size() * sizeof(float));
      const double done = cpu_clock_ms();
      if (round < 0) continue;
      w.ms.push_back(read - start);
      copy_ms.push_back(done - read);
      measure(w, dn, sensor.model.system_gain_dn_per_e, sensor.model.black_level_dn);
    }
  }
  std::sort(copy_ms.begin(), copy_ms.end());
  std::printf("kernels for %s, one thread, %d rounds, medians; memcpy of the frame %.3f ms/MP\n", draws::target_name(),
              rounds, copy_ms[copy_ms.size() / 2] / (pixels * 1e-6));
  std::printf("%-24s %12s %12s %14s %18s\n", "photons", "ms/MP", "times", "mean/truth", "variance/Poisson's");
  for (std::size_t i = 0; i < ways.size(); ++i) {
    std::printf("%-24s %12.1f %12.1f %14.4f %18.4f\n", ways[i].name.c_str(), ways[i].median_ms() / (pixels * 1e-6),
                ways[i].median_ms() / ways[i - i % 2].median_ms(), ways[i].mean_ratio, ways[i].variance_ratio);
  }
  std::printf("one standard error: mean %.5f, variance %.4f\n",
              std::sqrt(1 / (0.5 * pixels * ways[0].source.light().e_per_s.at(1, 0))), std::sqrt(2 / (0.5 * pixels)));
  return 0;
}
