#include "isp/pipeline/merge/merge_frames.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/merge/add_to_mean.h"
#include "isp/merge/align/align.h"
#include "isp/merge/block_test.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/merge/motion.h"
#include "isp/merge/placement.h"
#include "isp/merge/stars/drizzle.h"
#include "isp/merge/static_reference.h"
#include "isp/pipeline/merge/bracket_frames.h"
#include "isp/pipeline/merge/drizzled_raw.h"
#include "isp/pipeline/merge/frame_loader.h"
#include "isp/pipeline/merge/merge_budget.h"
#include "isp/pipeline/merge/merged_mosaic.h"
#include "isp/pipeline/merge/predicted_frame.h"
#include "isp/pipeline/merge/star_alignment.h"
#include "isp/pipeline/merge/star_reference.h"

namespace lowlux::isp {
namespace {

constexpr double site_false_alarm = 1e-5;    // of single sites, against such a reference
constexpr double blocks_of_alarm = 9;        // of the reference alone around a false alarm: one frame instead of all
constexpr double still_px = 0.5;             // largest displacement of a camera that stands still
constexpr double max_error_px = 1.5;         // standard error of a displacement, beyond which a frame is left out
constexpr double cell_error_px = 0.6;        // of whole cells: uniform over two pixels, 2 / sqrt(12)
constexpr double drop_radius_px = 1.5;       // sites of red and blue are two pixels apart, and stay apart
constexpr double star_drop_radius_px = 1;    // without a prediction; a drop always holds a sample of each colour
constexpr double noticeable_gaps = 1e-3;     // of the pixels of a drizzled image
constexpr double predicted_error_px = 0.35;  // error of a predicted difference, as a displacement

/// Adds up the times of each step.
void add_up(std::vector<StageTime>& times) {
  std::vector<StageTime> sums;
  for (const StageTime& time : times) {
    const auto known = std::ranges::find(sums, time.stage, &StageTime::stage);
    if (known == sums.end()) {
      sums.push_back(time);
    } else {
      known->seconds += time.seconds;
    }
  }
  times = std::move(sums);
}

class Merger {
 public:
  Merger(int count, const FrameReader& read, const MergeOptions& options, Executor& executor,
         const MergeProgress& progress)
      : count_(count),
        options_(options),
        executor_(executor),
        progress_(progress),
        clock_(out_.times),
        loader_(read, executor, clock_) {}

  Result<MergedRaw> run() {
    out_.reference = options_.reference.value_or(0);
    out_.frames.resize(static_cast<std::size_t>(count_));
    Result<void> done = begin();
    if (done && options_.drizzle && is_static()) {
      return fail(ErrorCode::invalid_argument,
                  count_ == 1
                      ? "drizzling needs several frames"
                      : "the frames did not move, and drizzling needs displaced ones: merge without drizzling, or "
                        "state how they are aligned",
                  loader_.reference_name());
    }
    if (done) done = is_static() ? add_static() : add_to_reference();
    if (done && loader_.exposures_differ() && !out_.bracket) {  // found late: begin anew
      out_.bracket = true;
      done = begin();
      if (done) done = add_to_reference();
    }
    if (!done) return tl::make_unexpected(done.error());
    finish();
    return std::move(out_);
  }

 private:
  /// Returns whether frames are compared with the mean of several, and not only with the reference frame.
  bool is_static() const { return out_.alignment == MergeAlignment::none && !out_.bracket; }

  /// Returns whether the reference is the robust mean of a few frames.
  bool has_robust_reference() const { return compares() && !out_.bracket && (is_static() || by_stars()); }

  bool by_stars() const { return out_.alignment == MergeAlignment::stars; }

  Result<void> begin() {
    Result<FrameElectrons> reference = loader_.read_reference(out_.reference);
    if (!reference) return tl::make_unexpected(reference.error());
    reference_ = *std::move(reference);
    out_.warnings = reference_.warnings;
    width_ = reference_.signal_e.width();
    height_ = reference_.signal_e.height();
    mean_.reset();
    drizzle_.reset();
    added_ = 0;
    reference_fraction_ = 1;
    bracket_.reset();
    if (options_.drizzle && options_.memory_limit_bytes) {
      const auto fits = check_drizzle_memory(width_, height_, *options_.drizzle, *options_.memory_limit_bytes);
      if (!fits) return tl::make_unexpected(at_frame(fits.error(), loader_.reference_name()));
    }
    return choose_method();
  }

  /// Chooses alignment and mean as the options state, or by the budget of the reference.
  Result<void> choose_method() {
    robust_ = options_.robust.value_or(true);
    const std::optional<ProcessingGoal>& goal = loader_.reference_options().effects;
    if (!goal || !goal->budget_s || !goal->cost) return choose_alignment();
    const RawDn& raw = loader_.reference().raw;
    const MergeWork work{count_, cost_size(raw.active.width, raw.active.height), options_.alignment, options_.robust};
    double budget_s = *goal->budget_s;
    if (options_.developed_after) budget_s -= developing_reserve_s(*goal->cost, cost_size(raw), budget_s);
    std::optional<bool> moved;
    if (measures_motion(*goal->cost, work, budget_s)) {
      if (Result<void> chosen = choose_alignment(); !chosen) return chosen;
      moved = out_.alignment != MergeAlignment::none;
    }
    out_.plan = choose_merge_method(*goal->cost, work, budget_s, moved);
    out_.alignment = out_.plan->method.alignment;
    robust_ = out_.plan->method.robust;
    if (!out_.plan->fits) {
      out_.warnings.push_back(
          fmt::format("merging takes at least {:.0f} ms by prediction, more than the budget of {:.3g} ms: the cheapest "
                      "method was used",
                      1e3 * out_.plan->predicted_s, 1e3 * budget_s));
    }
    return {};
  }

  /// Returns the mean signal of each site.
  PerSite<double> mean_level_e() const {
    PerSite<double> sum{}, sites{};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const float value = reference_.signal_e.at(x, y);
        if (!std::isfinite(value)) continue;
        sum[site_of(x, y)] += static_cast<double>(value);
        sites[site_of(x, y)] += 1;
      }
    }
    for (int i = 0; i < 4; ++i) sum[i] = sites[i] > 0 ? std::max(sum[i] / sites[i], 0.0) : 0;
    return sum;
  }

  /// Chooses the alignment from the motion of the last frame and of one in the middle.
  Result<void> choose_alignment() {
    out_.alignment = MergeAlignment::none;
    if (count_ == 1) return {};
    if (options_.alignment) {
      out_.alignment = *options_.alignment;
      return {};
    }
    std::vector<int> order;
    for (const int index : {count_ - 1, count_ / 2}) {
      if (index != out_.reference && (order.empty() || order.front() != index)) order.push_back(index);
    }
    const merge::AlignReference reference(view_of(reference_), executor_);
    loader_.expect(order);
    for (std::size_t i = 0; i < order.size(); ++i) {
      Result<FrameElectrons> frame = loader_.next();
      if (!frame) return tl::make_unexpected(frame.error());
      const Result<double> stated = light();
      if (!stated) return tl::make_unexpected(stated.error());
      const merge::Motion motion = merge::find_motion(reference, view_of(*frame), *stated, {}, executor_);
      if (motion.found && merge::median_shift_px(motion) > std::max(still_px, 5 * motion.standard_error_px)) {
        out_.alignment = MergeAlignment::subpixel;
      }
    }
    out_.bracket = loader_.exposures_differ();
    clock_.lap("motion of the camera");
    return {};
  }

  Result<double> light() const {
    if (!loader_.exposures_differ()) return 1.0;
    return loader_.stated_light();
  }

  /// Returns frames from all over the sequence that are averaged with the reference frame to what frames are compared
  /// with.
  std::vector<int> sampled_others() const {
    const int sampled = std::min(count_, sampled_frames);
    std::vector<int> out;
    for (int i = 0; i < sampled; ++i) {
      const int index = static_cast<int>((2LL * i + 1) * count_ / (2LL * sampled));
      if (index != out_.reference) out.push_back(index);
    }
    out.resize(std::min<std::size_t>(out.size(), static_cast<std::size_t>(sampled) - 1));
    return out;
  }

  /// Makes the mean of frames from all over the sequence the reference, where they show its scene.
  Result<void> find_static_reference() {
    const std::vector<int> order = sampled_others();
    std::vector<Plane<float>> others;
    loader_.expect(order);
    for (std::size_t i = 0; i < order.size(); ++i) {
      Result<FrameElectrons> frame = loader_.next();
      if (!frame) return tl::make_unexpected(frame.error());
      others.push_back(std::move(frame->signal_e));
    }
    reference_fraction_ = 1.0 / static_cast<double>(others.size() + 1);
    merge::StaticReference found = merge::make_static_reference(
        std::move(reference_.signal_e), std::move(others), {reference_.variance_e2, 1},
        {.block_false_alarm = options_.false_alarm / (blocks_of_alarm * count_), .site_false_alarm = site_false_alarm},
        options_.reference ? merge::Scene::reference : merge::Scene::majority, executor_);
    reference_.signal_e = std::move(found.mosaic);
    is_single_ = std::move(found.is_single);
    clock_.lap("robust mean");
    return {};
  }

  Result<void> add_static() {
    if (compares()) {
      if (Result<void> found = find_static_reference(); !found) return found;
    }
    begin_sum();
    std::vector<int> order(static_cast<std::size_t>(count_));
    for (int i = 0; i < count_; ++i) order[i] = i;
    loader_.expect(order);
    for (const int index : order) {
      Result<FrameElectrons> frame = loader_.next();
      if (!frame) return tl::make_unexpected(frame.error());
      if (loader_.exposures_differ()) return {};
      const merge::Comparison found =
          compared(frame->signal_e, {frame->variance_e2, 1},
                   {.block_false_alarm = options_.false_alarm,
                    .site_false_alarm = site_false_alarm,
                    .single_frame = {std::as_const(is_single_).view(), {reference_.variance_e2, 1}}},
                   index);
      mean_->add(std::as_const(frame->signal_e).view(), found.block_matches.view(), executor_);
      clock_.lap("mean");
      report_added();
    }
    return {};
  }

  /// Adds the reference, and the others where they match it.
  Result<void> add_to_reference() {
    if (Result<void> possible = check_bracket(); !possible) return possible;
    if (out_.bracket) bracket_.emplace(width_, height_, executor_).begin(reference_);
    if (Result<void> aligned = prepare_alignment(); !aligned) return aligned;
    Result<void> predicted = has_robust_reference() ? find_reference_of_stars() : predict_reference();
    if (!predicted || loader_.exposures_differ() != out_.bracket) return predicted;
    begin_sum();
    if (!has_robust_reference()) add_reference();
    std::vector<int> order;
    for (int i = 0; i < count_; ++i) {
      if (i != out_.reference || has_robust_reference()) order.push_back(i);
    }
    if (order.empty()) return {};
    loader_.expect(order);
    for (const int index : order) {
      Result<FrameElectrons> frame = loader_.next();
      if (!frame) return tl::make_unexpected(frame.error());
      if (loader_.exposures_differ() && !out_.bracket) return {};
      if (Result<void> added = add_moved(*frame, index); !added) return added;
    }
    return {};
  }

  Result<void> check_bracket() const {
    if (!out_.bracket) return {};
    const std::string& reference = loader_.reference_name();
    if (options_.drizzle) {
      return fail(ErrorCode::invalid_argument, "frames of other exposure than it cannot be drizzled: leave them out",
                  reference);
    }
    if (options_.keep_foreground) {
      return fail(ErrorCode::invalid_argument,
                  "the foreground of frames of other exposure than it cannot be kept apart: leave them out", reference);
    }
    return {};
  }

  RgbView<const float> expected() const {
    return prediction_.plane[0].empty() ? RgbView<const float>{} : prediction_.view();
  }

  /// Returns whether detail between the sites is predicted from the developed reference. Drizzling needs that for
  /// pixels without data.
  bool predicts() const {
    if (options_.drizzle) return true;
    return out_.alignment == MergeAlignment::subpixel || (by_stars() && compares());
  }

  Result<void> prepare_alignment() {
    if (!by_stars()) {
      tiles_.emplace(view_of(reference_), executor_);
      return {};
    }
    Result<StarAlignment> found = StarAlignment::of(view_of(reference_), executor_);
    if (!found) return tl::make_unexpected(at_frame(found.error(), loader_.reference_name()));
    stars_ = *std::move(found);
    out_.stars = stars_->stars();
    clock_.lap("stars");
    return {};
  }

  Result<void> find_reference_of_stars() {
    Result<StarReference> found =
        find_star_reference(loader_, reference_, *stars_, sampled_others(), options_.keep_foreground, executor_);
    if (!found) return tl::make_unexpected(found.error());
    reference_.signal_e = std::move(found->signal_e);
    reference_fraction_ = found->fraction;
    prediction_ = std::move(found->prediction);
    still_ = std::move(found->still);
    std::int64_t still = 0;
    for (std::size_t i = 0; i < still_.size(); ++i) still += still_.data()[i];
    if (!still_.empty()) out_.still_fraction = static_cast<double>(still) / static_cast<double>(still_.size());
    clock_.lap("robust mean");
    return {};
  }

  Result<void> predict_reference() {
    if (!predicts()) return {};
    Result<CameraRgb> predicted = predicted_electrons(loader_.reference(), loader_.reference_options(), executor_);
    if (!predicted) return tl::make_unexpected(at_frame(predicted.error(), loader_.reference_name()));
    prediction_ = *std::move(predicted);
    clock_.lap("prediction");
    return {};
  }

  /// Begins the mean. Until the reference is found, its memory is not needed.
  void begin_sum() {
    if (options_.drizzle) {
      drizzle_.emplace(width_, height_, *options_.drizzle);
      level_e_ = mean_level_e();
    } else {
      mean_.emplace(width_, height_);
    }
  }

  void add_reference() {
    const merge::Motion still = merge::no_motion(width_, height_);
    if (drizzle_) {
      drizzle_->add({.frame = view_of(reference_), .motion = still, .level_e = level_e_}, executor_);
    } else {
      Plane<float> site_weight;
      if (bracket_) site_weight = bracket_->placed_weights(reference_, 1, still);
      merge::add_placed(std::as_const(reference_.signal_e).view(), {std::as_const(site_weight).view(), {}}, *mean_,
                        executor_);
    }
    clock_.lap("mean");
  }

  /// Returns the motion of a frame; nullopt if it is too uncertain to use the frame.
  std::optional<merge::Motion> motion_of(const FrameElectrons& frame, double light, int index) {
    FrameUse& use = out_.frames[index];
    std::optional<merge::Motion> motion;
    if (out_.alignment == MergeAlignment::none || index == out_.reference) {
      motion = merge::no_motion(width_, height_);
    } else if (by_stars()) {
      motion = stars_->motion_of(view_of(frame), use, executor_);
    } else {
      motion = merge::find_motion(*tiles_, view_of(frame), light, {}, executor_);
    }
    clock_.lap("alignment");
    if (motion) {
      use.aligned = motion->found;
      use.largest_shift_px = merge::largest_shift_px(*motion);
      use.shift_error_px = motion->standard_error_px;
      if (!motion->found || motion->standard_error_px <= max_error_px) return motion;
    }
    use.aligned = false;
    use.used_fraction = 0;
    return std::nullopt;
  }

  /// Holds a frame with its values at the sites of the reference.
  struct MovedFrame {
    FrameElectrons& frame;
    const merge::Motion& motion;
    double light;
    const Plane<float>& differences;
    const Plane<float>& placed;
    const Plane<float>& site_weight;  // empty: all sites weigh the same
  };

  /// Adds a frame where it matches.
  void add_matching(const MovedFrame& moved, Plane<std::uint8_t>& matches, bool is_reference) {
    const auto part = [&](const Plane<std::uint8_t>& blocks) {
      return merge::MeanPart{moved.site_weight.view(), blocks.view()};
    };
    const bool as_drops = out_.alignment == MergeAlignment::subpixel || by_stars();
    if (drizzle_) {
      drizzle_->add({.frame = view_of(moved.frame),
                     .motion = moved.motion,
                     .level_e = level_e_,
                     .accepted_of_reference = {std::as_const(matches).view(), merge::block_px}},
                    executor_);
    } else if (!as_drops || is_reference) {
      merge::add_placed(moved.placed.view(), part(matches), *mean_, executor_);
    } else {
      const Plane<std::uint8_t> still = still_.empty() ? Plane<std::uint8_t>() : take_still_blocks(matches);
      if (by_stars()) {
        divide(moved.frame.signal_e, moved.light);
        add_drops(moved.frame.signal_e, moved.motion, {}, part(matches));
      } else {
        add_drops(moved.differences, moved.motion, expected(), part(matches));
      }
      if (!still.empty()) merge::add_placed(moved.placed.view(), part(still), *mean_, executor_);
    }
  }

  void add_drops(const Plane<float>& differences, const merge::Motion& motion, const RgbView<const float>& prediction,
                 const merge::MeanPart& part) {
    const double radius_px = by_stars() ? star_drop_radius_px : drop_radius_px;
    merge::add_drops(differences.view(), reference_.phase, motion, prediction, radius_px, part, *mean_, executor_);
  }

  Result<void> add_moved(FrameElectrons& frame, int index) {
    const Result<double> stated = light();
    if (!stated) return tl::make_unexpected(stated.error());
    Plane<float> saturated;
    if (bracket_) saturated = bracket_->remove_saturated(frame);
    FrameUse& use = out_.frames[index];
    const std::optional<merge::Motion> motion = motion_of(frame, *stated, index);
    report_added();
    if (!motion) return {};
    Plane<float> placed(width_, height_), site_weight;
    if (bracket_) {
      use.light = bracket_->measured_light(view_of(reference_), frame, *motion, *stated);
      bracket_->add(frame, use.light, saturated, *motion);
      site_weight = bracket_->placed_weights(frame, use.light, *motion);
      clock_.lap("exposure ratio");
    }
    Plane<float> differences(width_, height_);
    merge::subtract_prediction(view_of(frame), use.light, *motion, expected(), differences.view(), executor_);
    if (!by_stars() && !drizzle_) frame.signal_e = {};
    merge::place_nearest(std::as_const(differences).view(), frame.phase, *motion, expected(), placed.view(), executor_);
    put_still_blocks(still_, std::as_const(frame.signal_e).view(), placed.view(), executor_);
    clock_.lap("placement");
    double error_px = motion->standard_error_px;
    if (out_.alignment != MergeAlignment::none) error_px += predicts() ? predicted_error_px : cell_error_px;
    merge::Comparison found =
        compared(placed, merge::noise_in_light(frame.variance_e2, use.light),
                 {.block_false_alarm = options_.false_alarm, .displacement_error_px = error_px}, index);
    add_matching({frame, *motion, use.light, differences, placed, site_weight}, found.block_matches,
                 index == out_.reference);
    clock_.lap("mean");
    return {};
  }

  /// Removes the blocks that stand still from those that match. @return those that were removed
  Plane<std::uint8_t> take_still_blocks(Plane<std::uint8_t>& matches) const {
    if (matches.empty()) {
      matches = Plane<std::uint8_t>(still_.width(), still_.height());
      std::fill_n(matches.data(), matches.size(), std::uint8_t{1});
    }
    Plane<std::uint8_t> out(still_.width(), still_.height());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out.data()[i] = still_.data()[i] != 0 ? std::exchange(matches.data()[i], std::uint8_t{0}) : std::uint8_t{0};
    }
    return out;
  }

  void divide(Plane<float>& signal_e, double light) {
    if (light == 1) return;
    for_each_index(executor_, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) signal_e.at(x, y) /= static_cast<float>(light);
    });
  }

  bool compares() const { return robust_ && count_ > 1; }

  merge::Comparison compared(Plane<float>& mosaic, const merge::MosaicNoise& noise,
                             const merge::ComparisonOptions& options, int index) {
    if (!compares()) return {};
    merge::Comparison found =
        merge::compare_mosaics(std::as_const(reference_.signal_e).view(), {reference_.variance_e2, reference_fraction_},
                               mosaic.view(), noise, options, executor_);
    FrameUse& use = out_.frames[index];
    use.used_fraction = found.matching_fraction;
    use.outliers = found.outliers;
    use.mean_chi_square = found.mean_chi_square;
    clock_.lap("comparison");
    return found;
  }

  void report_added() {
    ++added_;
    if (progress_) progress_(static_cast<double>(added_) / count_);
  }

  void warn_of_gaps() {
    const double most = std::ranges::max(out_.empty_fraction);
    if (most < noticeable_gaps) return;
    out_.warnings.push_back(
        fmt::format("{:.1f} % of the pixels have no data of one colour and were filled from the denoised frames: take "
                    "more frames at other places, or a smaller image",
                    100 * most));
  }

  /// Fills sites at which no frame has a value that matches the mean of the sampled frames with that mean.
  void fill_unmatched() {
    for_each_index(executor_, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        if (mean_->weight().at(x, y) > 0) reference_.signal_e.at(x, y) = std::numeric_limits<float>::quiet_NaN();
      }
    });
    mean_->add(std::as_const(reference_.signal_e).view(), {}, executor_);
  }

  void warn_of_frames_left_out() {
    const auto left_out =
        std::ranges::count_if(out_.frames, [](const FrameUse& use) { return !use.aligned && use.used_fraction == 0; });
    if (left_out == 0) return;
    out_.warnings.push_back(fmt::format(
        "{} of {} frames were left out: {}", left_out, count_,
        by_stars() ? "their stars do not match those of the reference" : "their displacement is too uncertain"));
  }

  void finish() {
    warn_of_frames_left_out();
    if (drizzle_) {
      merge::DrizzleImage image = drizzle_->finish(executor_);
      encode_drizzled(image, *options_.drizzle, prediction_, reference_, loader_.reference(), out_, executor_);
      warn_of_gaps();
      clock_.lap("codes");
      return add_up(out_.times);
    }
    if (has_robust_reference()) fill_unmatched();
    encode_merged(*mean_, reference_, bracket_ ? bracket_->saturated() : PlaneView<const float>{}, loader_.reference(),
                  out_, executor_);
    clock_.lap("codes");
    add_up(out_.times);
    if (!out_.plan) return;
    for (const StageTime& time : out_.times) {
      if (time.stage != waiting_stage) out_.plan->taken_s += time.seconds;
    }
  }

  int count_;
  const MergeOptions& options_;
  Executor& executor_;
  const MergeProgress& progress_;
  MergedRaw out_;
  StageClock clock_;
  FrameLoader loader_;
  FrameElectrons reference_;
  CameraRgb prediction_;  // of the reference, without noise
  bool robust_ = true;
  double reference_fraction_ = 1;  // variance of the reference's signal over that of a frame
  Plane<std::uint8_t> is_single_;  // of a camera at rest: blocks of the reference that are one frame alone
  std::optional<BracketFrames> bracket_;
  int width_ = 0, height_ = 0;
  std::optional<merge::AlignReference> tiles_;  // how frames are aligned
  std::optional<StarAlignment> stars_;
  Plane<std::uint8_t> still_;              // blocks of the foreground: 1; empty: none
  std::optional<merge::MosaicMean> mean_;  // the sum is one of these
  std::optional<merge::Drizzle> drizzle_;
  PerSite<double> level_e_{};  // mean signal, for the weights of drizzling
  int added_ = 0;
};

}  // namespace

Result<MergedRaw> merge_frames(int count, const FrameReader& read, const MergeOptions& options, Executor& executor,
                               const MergeProgress& progress) {
  if (count < 1) return fail(ErrorCode::invalid_argument, "give at least one frame to merge");
  assert(!options.reference || (*options.reference >= 0 && *options.reference < count));
  return Merger(count, read, options, executor, progress).run();
}

}  // namespace lowlux::isp
