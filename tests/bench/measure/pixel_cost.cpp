// Measures the time of developing frames that are not mosaics:
//     measure pixel-cost ratios         the figures of PixelRatios (step_candidates.cpp)
//     measure pixel-cost draw [DRAW]    20 frames and levels drawn by DRAW (default 1): what they take over what is
//                                       predicted of the times of mosaics; exit code 1 if fewer than 95 % are within
//                                       20 %
// Times are processor times of one thread, the least of seven rounds.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "isp/cost/timing_frame.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/bench/measure/measure.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using denoise::Level;
using test::one_thread;

/// Returns a frame of the colours of a mosaic's cells, or of their greens.
RawFrame pixel_frame(const FrameSize& size, const TimingLight& light, SensorLayout layout) {
  RawFrame frame = timing_frame({2 * size.width, 2 * size.height}, light);
  RawDn& raw = frame.raw;
  const Plane<std::uint16_t> mosaic = std::move(raw.dn);
  const int samples = layout == SensorLayout::linear_rgb ? 3 : 1;
  raw.layout = layout;
  raw.dn = Plane<std::uint16_t>(samples * size.width, size.height);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const std::array values{mosaic.at(2 * x, 2 * y), mosaic.at(2 * x + 1, 2 * y), mosaic.at(2 * x + 1, 2 * y + 1)};
      for (int c = 0; c < samples; ++c) raw.dn.at(samples * x + c, y) = values[samples == 1 ? 1 : c];
    }
  }
  raw.active = raw.default_crop = {0, 0, size.width, size.height};
  raw.black_tag->samples = samples;
  raw.black_tag->pattern_dn.assign(static_cast<std::size_t>(samples), raw.black_tag->pattern_dn[0]);
  if (samples == 1) frame.colour = {};
  return frame;
}

DevelopOptions options_for(std::optional<Level> level) {
  DevelopOptions options;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = level.value_or(Level::draft);
  options.denoise.line_noise = false;
  options.demosaic = DemosaicMethod::malvar;
  options.find_defects = false;
  options.effects.emplace();
  return options;
}

/// Holds processor times [s].
struct Times {
  double planning = 0, check = 0, render = 0;
};

/// Returns the processor time that some work of this thread takes, the least of several rounds.
template <class Work>
double min_time(const Work& work) {
  double min_s = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 7; ++round) min_s = std::min(min_s, 1e-3 * test::ms_of(test::cpu_ms, work));
  return min_s;
}

Times times_of(const RawFrame& frame, std::optional<Level> level) {
  const double bare_s = min_time([&] { (void)plan_develop(frame, options_for({}), one_thread); });
  const double plan_s = min_time([&] { (void)plan_develop(frame, options_for(level), one_thread); });
  const double whole_s = min_time([&] { (void)develop(frame, options_for(level), one_thread); });
  return {bare_s, plan_s - bare_s, whole_s - plan_s};
}

void print_ratios() {
  std::printf("layout  size [MP]  level  planning  floats  check  cells\n");
  for (const SensorLayout layout : {SensorLayout::linear_rgb, SensorLayout::monochrome}) {
    for (const FrameSize& size : {FrameSize{336, 224}, {864, 576}, {1840, 1224}}) {
      for (const auto& [level, light] :
           {std::pair{Level::draft, TimingLight{200, 200}}, std::pair{Level::standard, TimingLight{200, 200}},
            std::pair{Level::high, TimingLight{0.5, 0.5}}}) {
        const RawFrame pixels = pixel_frame(size, light, layout);
        RawFrame mosaic = timing_frame(size, light);
        mosaic.corrections.defects = {{8, 8, 1, 1}};  // rendered from floats
        const RawFrame large = timing_frame({2 * size.width, 2 * size.height}, light);
        const Times plain = times_of(pixels, {}), reduced = times_of(pixels, level);
        const Times floats = times_of(mosaic, {}), mosaic_reduced = times_of(mosaic, level);
        const Times sites = times_of(large, level);
        const double tiles = cost_size(pixels.raw).denoised_megapixels / cost_size(large.raw).denoised_megapixels;
        const double render_ratio = plain.render / floats.render;
        std::printf("%6s %10.3f %6s %9.2f %7.2f %6.2f %6.2f\n", layout == SensorLayout::monochrome ? "grey" : "RGB",
                    1e-6 * size.width * size.height, std::string(denoise::name_of(level)).c_str(),
                    plain.planning / floats.planning, render_ratio,
                    (reduced.check - mosaic_reduced.check) / floats.render,
                    4 + (reduced.render - tiles * sites.render) / floats.render - render_ratio);
      }
    }
  }
}

/// Returns a cost model of the times of mosaics: one of as many pixels, and one of as many sites as the cells have.
std::shared_ptr<const CostModel> model_of(const FrameSize& size, const TimingLight& light, Level level) {
  RawFrame mosaic = timing_frame(size, light);
  mosaic.corrections.defects = {{8, 8, 1, 1}};
  const RawFrame large = timing_frame({2 * size.width, 2 * size.height}, light);
  const Times floats = times_of(mosaic, {}), reduced = times_of(mosaic, level), sites = times_of(large, level);
  auto model = std::make_shared<CostModel>();
  const auto set = [&](CostPart part, double megapixels, double seconds) {
    model->points[static_cast<std::size_t>(part)] = {{megapixels, seconds}};
  };
  const double megapixels = 1e-6 * size.width * size.height;
  set(CostPart::planning, megapixels, floats.planning);
  set(CostPart::check, megapixels, reduced.check);
  set(CostPart::floats, megapixels, floats.render);
  for (int start = 0; start < 3; ++start) {  // the same light has the same starts of chroma
    const int part = static_cast<int>(CostPart::draft_0) + 3 * static_cast<int>(level) + start;
    set(static_cast<CostPart>(part), cost_size(large.raw).denoised_megapixels, sites.render);
  }
  return model;
}

bool are_predicted(std::uint32_t seed) {
  constexpr int frames = 20;
  constexpr std::array lights{TimingLight{200, 200}, TimingLight{2, 0.5}, TimingLight{0.5, 0.5}};
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  int kept = 0;
  std::printf("layout  size [MP]     level  predicted [ms]  taken/predicted\n");
  for (int i = 0; i < frames; ++i) {
    const int width = static_cast<int>(std::lround(300 * std::pow(6, uniform(draw))));
    const FrameSize size{width & ~1, width * 2 / 3 & ~1};
    const TimingLight& light = lights[draw() % 3];
    const auto level = static_cast<Level>(draw() % 3);
    const SensorLayout layout = i % 2 == 0 ? SensorLayout::linear_rgb : SensorLayout::monochrome;
    const RawFrame frame = pixel_frame(size, light, layout);
    DevelopOptions options = options_for(level);
    options.effects->cost = model_of(size, light, level);
    const double predicted_s = *plan_develop(frame, options, one_thread)->effects->predicted_s;
    const double ratio = min_time([&] { (void)develop(frame, options, one_thread); }) / predicted_s;
    kept += std::fabs(ratio - 1) <= 0.2 ? 1 : 0;
    std::printf("%6s %10.3f %9s %15.1f %16.2f\n", layout == SensorLayout::monochrome ? "grey" : "RGB",
                1e-6 * size.width * size.height, std::string(denoise::name_of(level)).c_str(), 1e3 * predicted_s,
                ratio);
  }
  std::printf("%d of %d are within 20 %% of the prediction\n", kept, frames);
  return kept >= 0.95 * frames;
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_pixel_cost(Arguments& arguments) {
  const bool drawn = arguments.is_next("draw");
  if (!drawn) (void)arguments.is_next("ratios");
  const std::uint32_t seed = drawn ? arguments.next(std::uint32_t{1}, std::uint32_t{0}) : 0;
  arguments.end();
  if (drawn) return isp::are_predicted(seed) ? 0 : 1;
  isp::print_ratios();
  return 0;
}
