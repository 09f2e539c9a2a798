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
#include "isp/pipeline/frame_sample.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

struct FrameSize {
  int width;
  int height;
};
constexpr std::array<FrameSize, 4> sizes{{{256, 192}, {672, 448}, {1728, 1152}, {3680, 2448}}};
constexpr int passes = 5;  // over everything, so that a busy moment meets each part once
constexpr std::array<int, 4> rounds{5, 5, 3, 2};
constexpr std::size_t best_sizes = 3;  // what takes most of a second for each megapixel is left out on the largest
constexpr std::size_t sampled_size = sizes.size() - 1;  // large enough for a sample to save something
constexpr double black_dn = 512, white_dn = 16383, dn_per_e = 4, read_noise_e = 1.5;
/// Mean electrons, so that the chroma of most of the frame starts on level 0, 1 and 2.
constexpr std::array<double, 3> light_e{200, 2, 0.5};

/// Waves of light and colour with edges everywhere, as pictures have them, as noisy as the camera says: on smooth
/// frames the denoiser is faster, and Level::best slower.
/// @param line_noise_e  standard deviation of what each row has too much, and each column
RawFrame frame_of(const FrameSize& size, double mean_e, double line_noise_e = 0) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(size.width, size.height);
  std::vector<float> normal(static_cast<std::size_t>(size.width));
  const DrawStream stream{.seed = 8, .frame = 0, .purpose = draw_purpose::electrons};
  for (int y = 0; y < size.height; ++y) {
    normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, normal);
    const double row_e = line_noise_e * std::sqrt(2) * std::sin(12.9898 * y);
    for (int x = 0; x < size.width; ++x) {
      const int c = static_cast<int>(colour_at(raw.phase, x, y));
      const double wave = std::sin(2 * std::numbers::pi * (x * (3.0 + c) / size.width + y * 2.0 / size.height));
      const double texture = ((x / 6) ^ (y / 6)) % 5 == 0 ? 1.6 : 0.9;
      const double line_e = row_e + line_noise_e * std::sqrt(2) * std::sin(78.233 * x);
      const double e = mean_e * (1 + 0.3 * wave) * texture;
      const double noisy = e + line_e + std::sqrt(e + read_noise_e * read_noise_e) * static_cast<double>(normal[x]);
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

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

DevelopOptions options_for(std::optional<Level> level) {
  DevelopOptions options;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = level.value_or(Level::draft);
  options.effects.emplace();
  return options;
}

/// A machine is slower at times: a fixed piece of work, timed beside all else, is the unit of what is measured.
class Pace {
 public:
  explicit Pace(Executor& executor) : executor_(executor), frame_(frame_of({1024, 768}, 20)) {}

  Result<double> seconds() {
    const Result<Developed> developed = develop(frame_, options_for(Level::standard), executor_);
    if (!developed) return tl::make_unexpected(developed.error());
    double sum = 0;
    for (const StageTime& time : developed->plan.times) sum += time.seconds;
    taken_s_.push_back(sum);
    return sum;
  }
  double usual_s() const { return median(taken_s_); }

 private:
  Executor& executor_;
  RawFrame frame_;
  std::vector<double> taken_s_;
};

/// Median time of each step of developing, in units of the pace before it.
class Steps {
 public:
  static Result<Steps> of(const RawFrame& frame, const DevelopOptions& options, int count, Pace& pace,
                          Executor& executor) {
    Steps out;
    for (int i = 0; i < count; ++i) {
      const auto unit_s = pace.seconds();
      if (!unit_s) return tl::make_unexpected(unit_s.error());
      const Result<Developed> developed = develop(frame, options, executor);
      if (!developed) return tl::make_unexpected(developed.error());
      out.rounds_.push_back({*unit_s, developed->plan.times});
    }
    return out;
  }
  double of_step(std::string_view step) const {
    std::vector<double> values;
    for (const Round& round : rounds_) {
      for (const StageTime& time : round.times) {
        if (time.stage == step) values.push_back(time.seconds / round.unit_s);
      }
    }
    return median(std::move(values));
  }
  double planning() const {
    return of_step("black point") + of_step("thumbnail") + of_step("white and exposure") + of_step("effects");
  }
  double render() const { return of_step("render"); }

 private:
  struct Round {
    double unit_s;
    std::vector<StageTime> times;
  };
  std::vector<Round> rounds_;
};

double megapixels_of(const FrameSize& size) { return 1e-6 * size.width * size.height; }

/// All parts at one size, a pass at a time.
class Measurement {
 public:
  Measurement(std::size_t size, std::shared_ptr<const DisplayTarget> display, Pace& pace, Executor& executor)
      : size_(size), display_(std::move(display)), pace_(pace), executor_(executor) {
    for (const double mean_e : light_e) frames_.push_back(frame_of(sizes[size], mean_e));
    defective_ = frame_of(sizes[size], light_e[0]);
    defective_.corrections.defects = {{8, 8, 1, 1}};
    uneven_ = frame_of(sizes[size], light_e[0], 2);
  }

  Result<void> without_reduction() {
    DevelopOptions plain = options_for(std::nullopt);
    plain.find_defects = false;
    const auto codes = steps(frames_[0], plain);
    if (!codes) return tl::make_unexpected(codes.error());
    add(CostPart::codes, codes->render());
    const auto floats = steps(defective_, plain);
    if (!floats) return tl::make_unexpected(floats.error());
    add(CostPart::floats, floats->render());
    plain.samples = SampleType::u16;
    const auto codes_16 = steps(frames_[0], plain);
    if (!codes_16) return tl::make_unexpected(codes_16.error());
    add(CostPart::codes_16, codes_16->render() - codes->render());
    plain.samples = SampleType::f32;
    plain.space = OutputSpace::linear_srgb;
    plain.tone = ToneCurve::none;
    const auto linear = steps(frames_[0], plain);
    if (!linear) return tl::make_unexpected(linear.error());
    add(CostPart::floats_32, linear->render() - codes->render());
    return with_look(codes->render());
  }

  Result<void> planning() {
    DevelopOptions careful = options_for(Level::draft);
    careful.effects->all = true;
    const auto with_lines = steps(frames_[0], careful);
    if (!with_lines) return tl::make_unexpected(with_lines.error());
    const auto dark = steps(frames_[1], careful);
    if (!dark) return tl::make_unexpected(dark.error());
    add(CostPart::defects, (with_lines->of_step("defects") + dark->of_step("defects")) / 2);
    const auto uneven = steps(uneven_, careful);
    if (!uneven) return tl::make_unexpected(uneven.error());
    add(CostPart::offsets,
        uneven->of_step("noise model") + uneven->render() - with_lines->of_step("noise model") - with_lines->render());
    careful.denoise.line_noise = false;
    const auto without = steps(frames_[0], careful);
    if (!without) return tl::make_unexpected(without.error());
    add(CostPart::check, without->of_step("noise model"));
    add(CostPart::lines, with_lines->of_step("noise model") - without->of_step("noise model"));
    careful.find_defects = false;
    const auto bare = steps(frames_[0], careful);
    if (!bare) return tl::make_unexpected(bare.error());
    add(CostPart::planning, bare->planning());
    if (size_ == sampled_size) add(CostPart::samples, with_lines->planning() - bare->planning());
    return {};
  }

  Result<void> level(Level level) {
    constexpr std::array first{CostPart::draft_0, CostPart::standard_0, CostPart::high_0, CostPart::best_0};
    const bool best = level == Level::best;
    if (best && size_ >= best_sizes) return {};
    for (int start = 0; start < 3; ++start) {
      if (best && start == 1) continue;  // it begins with level 0 there too
      DevelopOptions options = options_for(level);
      options.find_defects = false;
      options.denoise.line_noise = false;
      const int count = best && megapixels_of(sizes[size_]) > 1 ? 1 : rounds[size_];
      const auto taken = Steps::of(frames_[static_cast<std::size_t>(start)], options, count, pace_, executor_);
      if (!taken) return tl::make_unexpected(taken.error());
      const int place = static_cast<int>(first[static_cast<std::size_t>(level)]) + (best ? start / 2 : start);
      add(static_cast<CostPart>(place), taken->render());
    }
    return {};
  }

  /// The median over the passes, of each part that was measured.
  void tell(CostModel& model) const {
    for (std::size_t part = 0; part < taken_.size(); ++part) {
      if (taken_[part].empty()) continue;
      const bool sampled = part == static_cast<std::size_t>(CostPart::samples);
      const double megapixels = sampled ? sample_megapixels : megapixels_of(sizes[size_]);
      model.points[part].push_back({megapixels, std::max(median(taken_[part]), 0.0) * pace_.usual_s()});
    }
  }

 private:
  Result<Steps> steps(const RawFrame& frame, const DevelopOptions& options) {
    return Steps::of(frame, options, rounds[size_], pace_, executor_);
  }
  Result<void> with_look(double codes) {
    DevelopOptions eye = options_for(std::nullopt);
    eye.find_defects = false;
    eye.look.look = Look::eye;
    eye.look.scene_luminance_cd_m2 = 0.1;
    const auto look = steps(frames_[0], eye);
    if (!look) return tl::make_unexpected(look.error());
    add(CostPart::look, look->render() - codes);
    DevelopOptions dim = options_for(std::nullopt);
    dim.find_defects = false;
    dim.effects->all = true;
    dim.display = display_;
    const auto changed = steps(frames_[0], dim);
    if (!changed) return tl::make_unexpected(changed.error());
    add(CostPart::display, changed->render() - codes);
    return {};
  }
  void add(CostPart part, double time) { taken_[static_cast<std::size_t>(part)].push_back(time); }

  std::size_t size_;
  std::shared_ptr<const DisplayTarget> display_;
  Pace& pace_;
  Executor& executor_;
  std::vector<RawFrame> frames_;  // of each light
  RawFrame defective_;
  RawFrame uneven_;                                    // with row and column noise
  std::array<std::vector<double>, cost_parts> taken_;  // in units of the pace
};

}  // namespace

Result<CostModel> measure_cost(Executor& executor, const std::function<void(double, const std::string&)>& advance) {
  auto target = display_target({.display_cd_m2 = 5}, executor);
  if (!target) return tl::make_unexpected(target.error());
  const auto display = std::make_shared<const DisplayTarget>(*std::move(target));
  Pace pace(executor);
  std::vector<Measurement> all;
  for (std::size_t i = 0; i < sizes.size(); ++i) all.emplace_back(i, display, pace, executor);
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const double share = std::array{0.01, 0.09, 0.3, 0.6}[i] / 6 / passes;
      const std::string name = fmt::format("{:.2g} MP", megapixels_of(sizes[i]));
      if (auto done = all[i].without_reduction(); !done) return tl::make_unexpected(done.error());
      advance(share, name + " without noise reduction");
      if (auto done = all[i].planning(); !done) return tl::make_unexpected(done.error());
      advance(share, name + ", planning");
      for (const Level level : denoise::all_levels) {
        if (auto done = all[i].level(level); !done) return tl::make_unexpected(done.error());
        advance(share, fmt::format("{}, {}", name, name_of(level)));
      }
    }
  }
  CostModel model;
  model.threads = executor.width();
  for (const Measurement& at : all) at.tell(model);
  return model;
}

}  // namespace lowlux::isp
