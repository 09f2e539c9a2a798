#include "isp/bench/gat_denoise.h"

#include <cmath>
#include <limits>

#include "denoise/variance_stabilize.h"

namespace lowlux::isp {
namespace {

constexpr double scale = 3e4;                 // its square, the variance, is within denoise::largest_e
constexpr double fine_q = 3, middle_q = 0.7;  // denoise/README.md, chroma start

int chroma_start(const DenoiseLight& light) {
  const double variance_e2 = light.mean_e + light.dark_e + light.read_noise_e * light.read_noise_e;
  const double q = light.mean_e / std::sqrt(variance_e2);
  if (q > fine_q) return 0;
  return q > middle_q ? 1 : 2;
}

}  // namespace

void gat_denoise(denoise::Denoiser& denoiser, const DenoiseShot& shot, denoise::Level level,
                 const std::array<double, 3>& white_gain, PlaneView<float> signal_e, Executor& executor) {
  const double noise_std_e = shot.light.read_noise_e;
  const denoise::GatTable table = denoise::gat_table(noise_std_e);
  Plane<float> stabilised(shot.raw_e.width(), shot.raw_e.height());
  for (std::size_t i = 0; i < stabilised.size(); ++i) {
    stabilised.data()[i] =
        static_cast<float>(scale * denoise::gat_forward(static_cast<double>(shot.raw_e.data()[i]), noise_std_e));
  }
  constexpr double variance = scale * scale;
  denoiser.run({stabilised.view(), BayerPhase::rggb}, {.variance_e2 = {variance, variance, variance}},
               {.level = level,
                .white_gain = white_gain,
                .rho = std::numeric_limits<double>::infinity(),
                .chroma_start = chroma_start(shot.light)},
               signal_e, {}, executor);
  for (int y = 0; y < signal_e.height; ++y) {
    float* const row = signal_e.row(y);
    for (int x = 0; x < signal_e.width; ++x) {
      const double total_e = denoise::gat_inverse_exact(table, static_cast<double>(row[x]) / scale);
      row[x] = static_cast<float>(total_e - shot.light.dark_e);
    }
  }
}

}  // namespace lowlux::isp
