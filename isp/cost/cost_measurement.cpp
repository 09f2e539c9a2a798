#include "isp/cost/cost_measurement.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cost/merge_cost.h"
#include "isp/cost/speed_probe.h"
#include "isp/cost/timing_frame.h"
#include "isp/metrics/statistics.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/develop.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

struct MeasuredSize {
  FrameSize frame;
  int rounds;
  bool best;       // whether Level::best is measured: it takes almost a second for each megapixel
  double advance;  // fraction of a pass
};
/// From about 0.9 MP on, the system allocates new memory for each frame: there is one size on each side of that.
constexpr std::array<MeasuredSize, 6> sizes{{{{256, 192}, 5, true, 0.01},
                                             {{672, 448}, 5, true, 0.07},
                                             {{1056, 704}, 4, false, 0.06},
                                             {{1296, 864}, 4, false, 0.1},
                                             {{1728, 1152}, 3, true, 0.3},
                                             {{3680, 2448}, 2, false, 0.46}}};
constexpr int passes = 5;  // over all measurements, so that a busy moment affects each part once
constexpr std::size_t sampled_size = sizes.size() - 1;  // large enough for a sample to save time
/// In these lights the chroma of a frame starts from level 0, 1 and 2. Tiles that start on different levels take a
/// little longer, and hardly any image starts on level 1 everywhere.
constexpr std::array<TimingLight, 3> lights{{{200, 200}, {2, 0.5}, {0.5, 0.5}}};

DevelopOptions options_for(std::optional<Level> level) {
  DevelopOptions options;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = level.value_or(Level::draft);
  options.demosaic = DemosaicMethod::malvar;
  options.effects.emplace();
  return options;
}

/// Holds the median time of each step of developing, in units of the pace before it.
class Steps {
 public:
  static Result<Steps> of(const RawFrame& frame, const DevelopOptions& options, int count, SpeedProbe& pace,
                          Executor& executor) {
    Steps out;
    for (int i = 0; i < count; ++i) {
      const auto unit_s = pace.seconds(executor);
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

/// Measures all parts at one size, one pass at a time.
class Measurement {
 public:
  Measurement(std::size_t size, std::shared_ptr<const DisplayTarget> display, SpeedProbe& pace, Executor& executor)
      : size_(size), display_(std::move(display)), pace_(pace), executor_(executor) {
    for (const TimingLight& light : lights) frames_.push_back(timing_frame(sizes[size].frame, light));
    for (std::size_t light = 0; light < defective_.size(); ++light) {
      defective_[light] = timing_frame(sizes[size].frame, lights[light]);
      defective_[light].corrections.defects = {{8, 8, 1, 1}};
    }
    uneven_ = timing_frame(sizes[size].frame, lights[0], 2);
  }

  Result<void> without_reduction() {
    DevelopOptions plain = options_for(std::nullopt);
    plain.find_defects = false;
    const auto codes = steps(frames_[0], plain);
    if (!codes) return tl::make_unexpected(codes.error());
    // Noise in the dark moves colours out of the gamut, and moving them back takes time.
    const auto dark = steps(frames_[1], plain);
    if (!dark) return tl::make_unexpected(dark.error());
    add(CostPart::codes, (codes->render() + dark->render()) / 2);
    double floats = 0;
    for (const RawFrame& frame : defective_) {
      const auto taken = steps(frame, plain);
      if (!taken) return tl::make_unexpected(taken.error());
      floats += taken->render() / static_cast<double>(defective_.size());
    }
    add(CostPart::floats, floats);
    for (const auto& [method, part] : {std::pair{DemosaicMethod::encoded_malvar, CostPart::encoded_malvar},
                                       std::pair{DemosaicMethod::residual, CostPart::residual},
                                       std::pair{DemosaicMethod::residual_median, CostPart::residual_median}}) {
      DevelopOptions by_method = plain;
      by_method.demosaic = method;
      const auto taken = steps(frames_[0], by_method);
      if (!taken) return tl::make_unexpected(taken.error());
      add(part, taken->render() - codes->render());
    }
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
    add(CostPart::lines, with_lines->of_step("noise model") - without->of_step("noise model"));
    DevelopOptions least = careful;
    least.find_defects = false;
    least.denoise.mode = DenoiseChoice::Mode::automatic;
    least.effects->all = false;
    least.effects->tolerance_delta_e = 1000;
    const auto bare = steps(frames_[0], least);
    if (!bare) return tl::make_unexpected(bare.error());
    add(CostPart::planning, bare->planning() + bare->of_step("noise model"));
    add(CostPart::check, without->of_step("noise model") - bare->of_step("noise model"));
    if (size_ == sampled_size) add(CostPart::samples, with_lines->planning() - bare->planning());
    return {};
  }

  Result<void> level(Level level) {
    constexpr std::array first{CostPart::draft_0, CostPart::standard_0, CostPart::high_0, CostPart::best_0};
    const bool best = level == Level::best;
    if (best && !sizes[size_].best) return {};
    for (int start = 0; start < 3; ++start) {
      if (best && start == 1) continue;  // with Level::best, chroma begins with level 0 there too
      DevelopOptions options = options_for(level);
      options.find_defects = false;
      options.denoise.line_noise = false;
      const int count = best && megapixels_of(sizes[size_].frame) > 1 ? 1 : sizes[size_].rounds;
      const auto taken = Steps::of(frames_[static_cast<std::size_t>(start)], options, count, pace_, executor_);
      if (!taken) return tl::make_unexpected(taken.error());
      const int place = static_cast<int>(first[static_cast<std::size_t>(level)]) + (best ? start / 2 : start);
      add(static_cast<CostPart>(place), taken->render());
    }
    return {};
  }

  /// Adds the median over the passes to the model, for each part that was measured.
  void add_to(CostModel& model, double pace_s) const {
    for (std::size_t part = 0; part < taken_.size(); ++part) {
      if (taken_[part].empty()) continue;
      const bool sampled = part == static_cast<std::size_t>(CostPart::samples);
      const CostSize size = cost_size(sizes[size_].frame.width, sizes[size_].frame.height);
      const double of_frame = size.megapixels_of(static_cast<CostPart>(part));
      const double megapixels = sampled ? sample_megapixels : of_frame;
      model.points[part].push_back({megapixels, std::max(median(taken_[part]), 0.0) * pace_s});
    }
  }

 private:
  Result<Steps> steps(const RawFrame& frame, const DevelopOptions& options) {
    return Steps::of(frame, options, sizes[size_].rounds, pace_, executor_);
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
  SpeedProbe& pace_;
  Executor& executor_;
  std::vector<RawFrame> frames_;                       // one for each light
  std::array<RawFrame, 2> defective_;                  // first two frames with defects
  RawFrame uneven_;                                    // frame with row and column noise
  std::array<std::vector<double>, cost_parts> taken_;  // in units of the pace
};

}  // namespace

Result<CostModel> measure_cost(Executor& executor, const std::function<void(double, const std::string&)>& advance) {
  auto target = display_target({.display_cd_m2 = 5}, executor);
  if (!target) return tl::make_unexpected(target.error());
  const auto display = std::make_shared<const DisplayTarget>(*std::move(target));
  SpeedProbe pace;
  std::vector<Measurement> all;
  for (std::size_t i = 0; i < sizes.size(); ++i) all.emplace_back(i, display, pace, executor);
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const double share = sizes[i].advance / 6 / passes;
      const std::string name = fmt::format("{:.2g} MP", megapixels_of(sizes[i].frame));
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
  model.pace_s = pace.median_s();
  for (const Measurement& at : all) at.add_to(model, model.pace_s);
  if (auto done = measure_merge_cost(pace, model.pace_s, executor, model); !done)
    return tl::make_unexpected(done.error());
  return model;
}

}  // namespace lowlux::isp
