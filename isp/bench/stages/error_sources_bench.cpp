#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/scenes/develop_scene.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::isp {
namespace {

constexpr PicturePart quick_part{192, 128};
constexpr PicturePart full_part{768, 512};
constexpr std::size_t pictures_used = 3;

struct NamedPlan {
  const char* name;
  DenoiseChoice denoise;
};

constexpr std::array plans{
    NamedPlan{"default", {.mode = DenoiseChoice::Mode::automatic}},
    NamedPlan{"best", {.mode = DenoiseChoice::Mode::level, .level = denoise::Level::best}},
};

/// Returns sRGB code values in 0..1.
template <class Code>
SceneLinear code_values(const Encoded<Code>& image) {
  SceneLinear out(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto code = static_cast<float>(image.codes.at(3 * x + static_cast<int>(c), y));
        out.plane[c].at(x, y) = code / static_cast<float>(std::numeric_limits<Code>::max());
      }
    }
  }
  return out;
}

double squared_error(const Developed& image, const SceneLinear& truth, Executor& executor) {
  return std::pow(10, -0.1 * codes_psnr_db(code_values(std::get<Encoded8>(image.picture)), truth, executor));
}

void add(const ErrorSources& from, double weight, ErrorSources& to) {
  to.demosaicing += weight * from.demosaicing;
  to.noise += weight * from.noise;
  to.black += weight * from.black;
  to.rendering += weight * from.rendering;
}

std::vector<BenchCell> row_of(const std::string& group, const char* plan, const ErrorSources& sources) {
  constexpr double white_code = 255;
  const double whole = sources.sum();
  return {group,
          std::string(plan),
          white_code * white_code * whole,
          100 * sources.demosaicing / whole,
          100 * sources.noise / whole,
          100 * sources.black / whole,
          100 * sources.rendering / whole};
}

/// Adds the rows of one light.
Result<void> add_rows(const std::vector<BenchPicture>& pictures, const DevelopLight& light, Executor& executor,
                      BenchTable& table) {
  std::array<std::array<ErrorSources, plans.size()>, 2> sums{};
  constexpr std::array looks{Look::camera, Look::eye};
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const auto raws = simulated_raws(pictures[i], light, i + 1, executor);
    if (!raws) return tl::make_unexpected(raws.error());
    const auto automatic = plan_develop(raws->mean, {.find_defects = false}, executor);
    if (!automatic) return tl::make_unexpected(automatic.error());
    for (std::size_t look = 0; look < looks.size(); ++look) {
      for (std::size_t plan = 0; plan < plans.size(); ++plan) {
        DevelopOptions options{.exposure_ev = automatic->rendering.exposure_ev, .denoise = plans[plan].denoise};
        options.look.look = looks[look];
        options.look.scene_luminance_cd_m2 = light.scene_cd_m2;
        const auto sources = error_sources(*raws, light, options, executor);
        if (!sources) return tl::make_unexpected(sources.error());
        add(*sources, 1 / static_cast<double>(pictures.size()), sums[look][plan]);
      }
    }
  }
  for (std::size_t look = 0; look < looks.size(); ++look) {
    const std::string group = fmt::format("{}, {}", light.name, looks[look] == Look::eye ? "eye" : "camera");
    for (std::size_t plan = 0; plan < plans.size(); ++plan) {
      table.rows.push_back(row_of(group, plans[plan].name, sums[look][plan]));
    }
  }
  return {};
}

}  // namespace

Result<ErrorSources> error_sources(const SimulatedRaws& raws, const DevelopLight& light, const DevelopOptions& options,
                                   Executor& executor) {
  DevelopOptions exact = options;  // without repairs and noise reduction
  exact.denoise.mode = DenoiseChoice::Mode::off;
  exact.find_defects = false;
  const auto rendered = develop(raws.truth, exact, executor);
  if (!rendered) return tl::make_unexpected(rendered.error());
  exact.samples = SampleType::u16;
  const auto reference = develop(raws.truth, exact, executor);
  if (!reference) return tl::make_unexpected(reference.error());
  exact.samples = SampleType::u8;
  const SceneLinear truth = code_values(std::get<Encoded16>(reference->picture));

  DevelopOptions noisy = options;
  noisy.exposure_ev = noisy_exposure_ev(raws.noisy, light, *options.exposure_ev);
  const auto whole = develop(raws.noisy, noisy, executor);
  if (!whole) return tl::make_unexpected(whole.error());
  noisy.black = {.choice = BlackChoice::measured, .measured = whole->plan.levels.black};
  noisy.black.measured->source = BlackPoint::Source::given;
  noisy.black.measured->pedestal_dn.fill(true_black_dn(raws.noisy, light));
  const auto with_true_black = develop(raws.noisy, noisy, executor);
  if (!with_true_black) return tl::make_unexpected(with_true_black.error());

  exact.demosaic = whole->plan.demosaic.demosaic.method;
  const auto without_noise = develop(raws.mean, exact, executor);
  if (!without_noise) return tl::make_unexpected(without_noise.error());

  const double rendering = squared_error(*rendered, truth, executor);
  const double demosaiced = squared_error(*without_noise, truth, executor);
  const double noise_left = squared_error(*with_true_black, truth, executor);
  return ErrorSources{.demosaicing = demosaiced - rendering,
                      .noise = noise_left - demosaiced,
                      .black = squared_error(*whole, truth, executor) - noise_left,
                      .rendering = rendering};
}

Result<BenchOutcome> run_error_sources_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto all = files_of(options.pictures);
  const auto pictures = read_bench_pictures(
      options.pictures_folder,
      options.quick ? quick_files_of(options.pictures) : all.first(std::min(pictures_used, all.size())),
      options.quick ? quick_part : full_part, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  BenchOutcome out{.threads = options.threads};
  out.table.columns = {"case",      "plan",         "mean squared error [codes^2]", "demosaicing [%]", "noise [%]",
                       "black [%]", "rendering [%]"};
  const std::vector<DevelopLight> lights = develop_lights(options.quick);
  for (const DevelopLight& light : lights) {
    const auto added = add_rows(*pictures, light, executor, out.table);
    if (!added) return tl::make_unexpected(added.error());
    options.advance(1 / static_cast<double>(lights.size()), "sources of error at " + light.name);
  }
  out.remarks.push_back(
      fmt::format("{} images{} by the camera of the stage `develop`; errors of 8-bit sRGB codes against the true "
                  "colours of every pixel, developed to 16 bits with the same brightness and look",
                  pictures->size(), options.quick ? ", quick: crops of them," : ""));
  out.remarks.emplace_back(
      "percentages add up to 100. Black is the decrease of the error with the true black level instead of the measured "
      "one; noise is the further decrease without noise, noise reduction and repairs; demosaicing is the further "
      "decrease with the true colours of every pixel; rendering is the remaining error of rounding to 8 bits");
  return out;
}

}  // namespace lowlux::isp
