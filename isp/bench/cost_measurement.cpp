#include "isp/bench/cost_measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/random.h"
#include "isp/pipeline/develop.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

struct FrameSize {
  int width;
  int height;
};
constexpr std::array<FrameSize, 4> sizes{{{256, 192}, {672, 448}, {1728, 1152}, {3680, 2448}}};
constexpr std::array<int, 4> rounds{9, 7, 5, 3};
constexpr std::size_t best_sizes = 2;  // what takes seconds for each megapixel is measured on the smaller ones, once
constexpr double black_dn = 512, white_dn = 16383, dn_per_e = 4, read_noise_e = 1.5;
/// Mean electrons, so that the chroma of most of the frame starts on level 0, 1 and 2.
constexpr std::array<double, 3> light_e{200, 2, 0.5};

/// Waves of light and colour with fine texture, as noisy as the camera says.
RawFrame frame_of(const FrameSize& size, double mean_e) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(size.width, size.height);
  std::vector<float> normal(static_cast<std::size_t>(size.width));
  const DrawStream stream{.seed = 8, .frame = 0, .purpose = draw_purpose::electrons};
  for (int y = 0; y < size.height; ++y) {
    normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, normal);
    for (int x = 0; x < size.width; ++x) {
      const int c = static_cast<int>(colour_at(raw.phase, x, y));
      const double wave = std::sin(2 * std::numbers::pi * (x * (3.0 + c) / size.width + y * 2.0 / size.height));
      const double texture = ((x / 6) ^ (y / 6)) % 5 == 0 ? 1.04 : 0.99;
      const double e = mean_e * (1 + 0.3 * wave) * texture;
      const double noisy = e + std::sqrt(e + read_noise_e * read_noise_e) * static_cast<double>(normal[x]);
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(black_dn + dn_per_e * noisy, 0.0, white_dn)));
    }
  }
  raw.active = raw.default_crop = {0, 0, size.width, size.height};
  raw.black_tag = BlackLevel{.pattern_dn = {black_dn}};
  raw.white_dn.fill(white_dn);
  const double full_e = (white_dn - black_dn) / dn_per_e;
  NoiseProfile noise;
  noise.scale.fill(1 / full_e);
  noise.offset.fill((read_noise_e * read_noise_e + 1 / (12 * dn_per_e * dn_per_e)) / (full_e * full_e));
  frame.noise = noise;
  const Vector3 neutral{0.5, 1, 0.7};
  frame.colour.calibrations = {
      {.cct_k = 6504, .xyz_to_camera = diagonal3(neutral) * *xyz_to_output(OutputSpace::linear_srgb)}};
  frame.colour.as_shot_neutral = neutral;
  return frame;
}

/// Median time of each step of developing.
class Steps {
 public:
  static Result<Steps> of(const RawFrame& frame, const DevelopOptions& options, int count, Executor& executor) {
    Steps out;
    for (int i = 0; i < count; ++i) {
      const Result<Developed> developed = develop(frame, options, executor);
      if (!developed) return tl::make_unexpected(developed.error());
      out.rounds_.push_back(developed->plan.times);
    }
    return out;
  }
  double s(std::string_view step) const {
    std::vector<double> values;
    for (const auto& round : rounds_) {
      for (const StageTime& time : round) {
        if (time.stage == step) values.push_back(time.seconds);
      }
    }
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
  double planning_s() const { return s("black point") + s("thumbnail") + s("white and exposure") + s("effects"); }
  double render_s() const { return s("render"); }

 private:
  std::vector<std::vector<StageTime>> rounds_;
};

DevelopOptions options_for(std::optional<Level> level) {
  DevelopOptions options;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = level.value_or(Level::draft);
  options.effects.emplace();
  return options;
}

/// All parts at one size.
class Measurement {
 public:
  Measurement(std::size_t size, std::shared_ptr<const DisplayTarget> display, CostModel& model, Executor& executor)
      : size_(size),
        display_(std::move(display)),
        megapixels_(1e-6 * sizes[size].width * sizes[size].height),
        model_(model),
        executor_(executor),
        bright_(frame_of(sizes[size], light_e[0])) {}

  Result<void> without_reduction() {
    DevelopOptions plain = options_for(std::nullopt);
    plain.find_defects = false;
    const auto codes = steps(bright_, plain);
    if (!codes) return tl::make_unexpected(codes.error());
    add(CostPart::codes, codes->render_s());
    RawFrame defective = frame_of(sizes[size_], light_e[0]);
    defective.corrections.defects = {{8, 8, 1, 1}};
    const auto floats = steps(defective, plain);
    if (!floats) return tl::make_unexpected(floats.error());
    add(CostPart::floats, floats->render_s());
    plain.samples = SampleType::u16;
    const auto codes_16 = steps(bright_, plain);
    if (!codes_16) return tl::make_unexpected(codes_16.error());
    add(CostPart::codes_16, codes_16->render_s() - codes->render_s());
    plain.samples = SampleType::f32;
    plain.space = OutputSpace::linear_srgb;
    plain.tone = ToneCurve::none;
    const auto linear = steps(bright_, plain);
    if (!linear) return tl::make_unexpected(linear.error());
    add(CostPart::floats_32, linear->render_s() - codes->render_s());
    return with_look(codes->render_s());
  }

  Result<void> planning() {
    DevelopOptions careful = options_for(Level::draft);
    careful.effects->all = true;
    const auto with_lines = steps(bright_, careful);
    if (!with_lines) return tl::make_unexpected(with_lines.error());
    add(CostPart::planning, with_lines->planning_s());
    add(CostPart::defects, with_lines->s("defects"));
    careful.denoise.line_noise = false;
    const auto without = steps(bright_, careful);
    if (!without) return tl::make_unexpected(without.error());
    add(CostPart::check, without->s("noise model"));
    add(CostPart::lines, with_lines->s("noise model") - without->s("noise model"));
    return {};
  }

  Result<void> level(Level level) {
    constexpr std::array first{CostPart::draft_0, CostPart::standard_0, CostPart::high_0, CostPart::best_0};
    const bool best = level == Level::best;
    if (best && size_ >= best_sizes) return {};
    for (int start = 0; start < 3; ++start) {
      if (best && start == 1) continue;  // it begins with level 0 there too
      const RawFrame frame = frame_of(sizes[size_], light_e[static_cast<std::size_t>(start)]);
      DevelopOptions options = options_for(level);
      options.find_defects = false;
      options.denoise.line_noise = false;
      const auto taken = Steps::of(frame, options, best ? 1 : rounds[size_], executor_);
      if (!taken) return tl::make_unexpected(taken.error());
      const int place = static_cast<int>(first[static_cast<std::size_t>(level)]) + (best ? start / 2 : start);
      add(static_cast<CostPart>(place), taken->render_s());
    }
    return {};
  }

 private:
  Result<Steps> steps(const RawFrame& frame, const DevelopOptions& options) {
    return Steps::of(frame, options, rounds[size_], executor_);
  }
  Result<void> with_look(double codes_s) {
    DevelopOptions eye = options_for(std::nullopt);
    eye.find_defects = false;
    eye.look.look = Look::eye;
    eye.look.scene_luminance_cd_m2 = 0.1;
    const auto look = steps(bright_, eye);
    if (!look) return tl::make_unexpected(look.error());
    add(CostPart::look, look->render_s() - codes_s);
    DevelopOptions dim = options_for(std::nullopt);
    dim.find_defects = false;
    dim.effects->all = true;
    dim.display = display_;
    const auto changed = steps(bright_, dim);
    if (!changed) return tl::make_unexpected(changed.error());
    add(CostPart::display, changed->render_s() - codes_s);
    return {};
  }
  void add(CostPart part, double seconds) {
    model_.points[static_cast<std::size_t>(part)].push_back({megapixels_, std::max(seconds, 0.0)});
  }

  std::size_t size_;
  std::shared_ptr<const DisplayTarget> display_;
  double megapixels_;
  CostModel& model_;
  Executor& executor_;
  RawFrame bright_;
};

}  // namespace

Result<CostModel> measure_cost(Executor& executor, const std::function<void(double, const std::string&)>& advance) {
  auto target = display_target({.display_cd_m2 = 5}, executor);
  if (!target) return tl::make_unexpected(target.error());
  const auto display = std::make_shared<const DisplayTarget>(*std::move(target));
  CostModel model;
  model.threads = executor.width();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double share = std::array{0.01, 0.09, 0.25, 0.65}[i] / 6;
    Measurement at(i, display, model, executor);
    const std::string name = fmt::format("{:.1f} MP", 1e-6 * sizes[i].width * sizes[i].height);
    if (auto done = at.without_reduction(); !done) return tl::make_unexpected(done.error());
    advance(share, name + " without noise reduction");
    if (auto done = at.planning(); !done) return tl::make_unexpected(done.error());
    advance(share, name + ", planning");
    for (const Level level : denoise::all_levels) {
      if (auto done = at.level(level); !done) return tl::make_unexpected(done.error());
      advance(share, fmt::format("{}, {}", name, name_of(level)));
    }
  }
  return model;
}

}  // namespace lowlux::isp
