#include "isp/pipeline/merge/moved_merge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/merge/block_test.h"
#include "isp/merge/placement.h"
#include "isp/pipeline/merge/drizzled_raw.h"
#include "isp/pipeline/merge/merge_budget.h"
#include "isp/pipeline/merge/merged_mosaic.h"
#include "isp/pipeline/merge/predicted_frame.h"
#include "isp/pipeline/merge/shading.h"
#include "isp/pipeline/merge/star_reference.h"

namespace lowlux::isp {
namespace {

constexpr double max_error_px = 1.5;         // standard error of a displacement, beyond which a frame is left out
constexpr double cell_error_px = 0.6;        // of whole cells: uniform over two pixels, 2 / sqrt(12)
constexpr double noticeable_gaps = 1e-3;     // of the pixels of a drizzled image
constexpr double predicted_error_px = 0.35;  // error of a predicted difference, as a displacement

/// Returns the radius of the drops of so many frames with a signal-to-noise ratio: 1.5 px up to a ratio of 8 of their
/// mean, less above that, for detail that the prediction lacks, and 1 px from 12 on, so that a drop holds a sample of
/// green. Chosen on the tuning set by developed images: smaller drops leave more to noise reduction, which knows
/// detail.
double drop_radius_px(int frames, double signal_to_noise) {
  const double radius_px = 12 / (std::sqrt(static_cast<double>(frames)) * signal_to_noise);
  return std::clamp(std::round(64 * radius_px) / 64, 1.0, 1.5);  // of one value for all math libraries
}

/// Returns the signal-to-noise ratio of a site at the mean level.
double mean_signal_to_noise(const PerSite<double>& level_e, const FrameElectrons& frame) {
  double level = 0, variance = 0;
  for (int site = 0; site < 4; ++site) {
    level += level_e[site] / 4;
    variance += (level_e[site] + frame.variance_e2[site] + frame.common_variance_e2[site]) / 4;
  }
  return level / std::sqrt(std::max(variance, 1e-6));
}

void divide(Plane<float>& signal_e, double light, Executor& executor) {
  if (light == 1) return;
  for_each_index(executor, signal_e.height(), [&](int y) {
    for (int x = 0; x < signal_e.width(); ++x) signal_e.at(x, y) /= static_cast<float>(light);
  });
}

/// Returns the share of the blocks that count.
double used_share(PlaneView<const std::uint8_t> block_matches) {
  if (block_matches.data == nullptr) return 1;
  double used = 0;
  for (int y = 0; y < block_matches.height; ++y) {
    const std::uint8_t* const row = block_matches.row(y);
    used += static_cast<double>(block_matches.width - std::count(row, row + block_matches.width, std::uint8_t{0}));
  }
  return used / (static_cast<double>(block_matches.width) * block_matches.height);
}

void warn_of_gaps(MergedRaw& out) {
  const double most = std::ranges::max(out.empty_fraction);
  if (most < noticeable_gaps) return;
  out.warnings.push_back(
      fmt::format("{:.1f} % of the pixels have no data of one colour and were filled from the denoised frames: take "
                  "more frames at other positions, or choose a smaller image",
                  100 * most));
}

}  // namespace

Result<void> MovedMerge::add_frames() {
  if (Result<void> possible = check_bracket(); !possible) return possible;
  if (work_.out.bracket) bracket_.emplace(work_.width, work_.height, work_.executor).begin(work_.reference);
  if (Result<void> prepared = prepare_alignment(); !prepared) return prepared;
  Result<void> predicted = has_robust_reference() ? average_reference() : predict();
  if (!predicted || work_.loader.exposures_differ() != work_.out.bracket) return predicted;
  begin_sum();
  if (!has_robust_reference()) add_reference();
  std::vector<int> order;
  for (int i = 0; i < work_.count; ++i) {
    if (i != work_.out.reference || has_robust_reference()) order.push_back(i);
  }
  if (order.empty()) return {};
  work_.loader.expect(order);
  int averaged = 1;
  for (const int index : order) {
    Result<FrameElectrons> frame = work_.loader.next();
    if (!frame) return tl::make_unexpected(frame.error());
    if (work_.loader.exposures_differ() && !work_.out.bracket) return {};
    if (Result<void> added = add(*frame, index); !added) return added;
    if (work_.out.frames[static_cast<std::size_t>(index)].used_fraction == 0 || !predicts_again(++averaged)) continue;
    if (Result<void> again = predict_again(); !again) return again;
    if (!will_predict_again(averaged, work_.count)) colours_.reset();
  }
  return {};
}

void MovedMerge::encode() {
  colours_.reset();
  work_.adopt_saturation();
  RawFrame& frame = work_.loader.reference();
  if (drizzle_) {
    merge::DrizzleImage image = drizzle_->finish(work_.executor);
    encode_drizzled(image, *work_.options.drizzle, prediction_, work_.reference, frame, work_.out, work_.executor);
    warn_of_gaps(work_.out);
    return;
  }
  if (has_robust_reference()) work_.fill_unmatched(*mean_);
  const double frames = frames_used_ + (has_robust_reference() ? 0 : 1);  // with the reference
  for (std::size_t c = 0; c < 3 && frames > 0; ++c) work_.out.drop_noise[c] = 1 + excess_noise_[c] / frames;
  if (bracket_) bracket_->fill_unmatched(*mean_);
  encode_merged(*mean_, work_.reference, bracket_ ? bracket_->saturated() : PlaneView<const float>{}, frame, work_.out,
                work_.executor);
}

/// Returns whether detail between the sites is predicted from the developed reference. Drizzling needs that for pixels
/// without data.
bool MovedMerge::predicts() const {
  if (work_.options.drizzle) return true;
  return work_.out.alignment == MergeAlignment::subpixel || (by_stars() && work_.compares());
}

RgbView<const float> MovedMerge::expected() const {
  return prediction_.plane[0].empty() ? RgbView<const float>{} : prediction_.view();
}

Result<void> MovedMerge::check_bracket() const {
  if (!work_.out.bracket) return {};
  const std::string& reference = work_.loader.reference_name();
  if (work_.options.drizzle) {
    return fail(ErrorCode::invalid_argument,
                "frames of another exposure than the reference cannot be drizzled: leave them out", reference);
  }
  if (work_.options.keep_foreground) {
    return fail(ErrorCode::invalid_argument,
                "--foreground keep does not support frames of another exposure than the reference: leave them out",
                reference);
  }
  return {};
}

Result<void> MovedMerge::prepare_alignment() {
  if (!changes_shading()) {
    work_.reference.gain = {};
    work_.loader.omit_gains();
  }
  if (!by_stars()) {
    with_unshaded(work_.reference, work_.executor,
                  [&](const merge::FrameView& view) { tiles_.emplace(view, work_.executor); });
    if (work_.reference.gain.empty()) return {};
    // Gains of single pixels do not outlast motion: encode_merged smooths them.
    RawCorrections smooth = work_.loader.reference().corrections;
    smooth_gain_maps(smooth, work_.height, work_.executor);
    gain_ = shading_gain(smooth, work_.width, work_.height, work_.executor);
    change_shading(work_.reference, merge::no_motion(work_.width, work_.height), std::as_const(gain_).view(),
                   work_.executor);
    work_.reference.gain = {};
    return {};
  }
  Result<StarAlignment> found = StarAlignment::of(view_of(work_.reference), work_.executor);
  if (!found) return tl::make_unexpected(at_frame(found.error(), work_.loader.reference_name()));
  stars_ = *std::move(found);
  work_.out.stars = stars_->stars();
  work_.clock.lap("stars");
  return {};
}

/// Makes the robust mean of a few frames the reference, and predicts from it.
Result<void> MovedMerge::average_reference() {
  Result<StarReference> found = find_star_reference(work_.loader, work_.reference, *stars_, work_.sampled_others(),
                                                    work_.options.keep_foreground, work_.executor);
  if (!found) return tl::make_unexpected(found.error());
  work_.reference.signal_e = std::move(found->signal_e);
  work_.reference_fraction = found->fraction;
  prediction_ = std::move(found->prediction);
  still_ = std::move(found->still);
  std::int64_t still = 0;
  for (std::size_t i = 0; i < still_.size(); ++i) still += still_.data()[i];
  if (!still_.empty()) work_.out.still_fraction = static_cast<double>(still) / static_cast<double>(still_.size());
  work_.clock.lap("robust mean");
  return {};
}

Result<void> MovedMerge::predict() {
  if (!predicts()) return {};
  Result<CameraRgb> predicted =
      predicted_electrons(work_.loader.reference(), work_.loader.reference_options(), work_.executor);
  if (!predicted) return tl::make_unexpected(at_frame(predicted.error(), work_.loader.reference_name()));
  prediction_ = *std::move(predicted);
  work_.clock.lap("prediction");
  return {};
}

/// Returns whether the mean is one of differences to the prediction.
bool MovedMerge::averages_differences() const {
  return work_.out.alignment == MergeAlignment::subpixel && !work_.options.drizzle && !work_.out.bracket;
}

/// Returns whether the mean of so many frames is to predict the reference in place of a mean of fewer.
bool MovedMerge::predicts_again(int averaged) const {
  return averages_differences() && isp::predicts_again(averaged, work_.count);
}

/// Predicts the reference from the mean of the frames so far, of all colours at every pixel.
Result<void> MovedMerge::predict_again() {
  Result<void> predicted = predict_electrons(*colours_, work_.reference, work_.loader.reference(),
                                             work_.loader.reference_options(), prediction_, work_.executor);
  if (!predicted) return tl::make_unexpected(at_frame(predicted.error(), work_.loader.reference_name()));
  work_.clock.lap("prediction");
  return {};
}

/// Begins the mean.
void MovedMerge::begin_sum() {
  level_e_ = mean_level_e();
  if (!by_stars()) drop_radius_px_ = drop_radius_px(work_.count, mean_signal_to_noise(level_e_, work_.reference));
  if (work_.options.drizzle) {
    drizzle_.emplace(work_.width, work_.height, *work_.options.drizzle);
  } else {
    mean_.emplace(work_.width, work_.height);
  }
  if (averages_differences() && will_predict_again(1, work_.count)) {
    colours_.emplace(work_.width, work_.height);
  }
}

void MovedMerge::add_reference() {
  const FrameElectrons& reference = work_.reference;
  const merge::Motion still = merge::no_motion(work_.width, work_.height);
  if (drizzle_) {
    drizzle_->add({.frame = view_of(reference), .motion = still, .level_e = level_e_}, work_.executor);
  } else {
    Plane<float> site_weight;
    if (bracket_) site_weight = bracket_->placed_weights(reference, 1, still);
    merge::add_placed(reference.signal_e.view(), {std::as_const(site_weight).view(), {}}, *mean_, work_.executor);
  }
  work_.clock.lap("mean");
}

/// Adds another frame where it matches the reference.
Result<void> MovedMerge::add(FrameElectrons& frame, int index) {
  const Result<double> stated = work_.stated_light();
  if (!stated) return tl::make_unexpected(stated.error());
  Plane<float> saturated;
  if (bracket_) saturated = bracket_->remove_saturated(frame);
  FrameUse& use = work_.out.frames[static_cast<std::size_t>(index)];
  const std::optional<merge::Motion> motion = motion_of(frame, *stated, index);
  work_.report_added();
  if (!motion) return {};
  Executor& executor = work_.executor;
  if (changes_shading()) change_shading(frame, *motion, std::as_const(gain_).view(), executor);
  frame.gain = {};
  Plane<float> site_weight;
  bool is_least = false;  // the frame has the least light of the bracket so far
  if (bracket_) {
    use.light = bracket_->measured_light(view_of(work_.reference), frame, *motion, *stated);
    is_least = bracket_->add(frame, use.light, saturated, *motion);
    site_weight = bracket_->placed_weights(frame, use.light, *motion);
    work_.clock.lap("exposure ratio");
  }
  const merge::FrameView signal = view_of(frame);
  const bool keeps_signal = by_stars() || drizzle_;
  Plane<float> differences = keeps_signal ? Plane<float>(work_.width, work_.height) : std::move(frame.signal_e);
  merge::subtract_prediction(signal, use.light, *motion, expected(), differences.view(), executor);
  Plane<float> placed(work_.width, work_.height);
  merge::place_nearest(std::as_const(differences).view(), frame.phase, *motion, expected(), placed.view(), executor);
  put_still_blocks(still_, std::as_const(frame.signal_e).view(), placed.view(), executor);
  work_.clock.lap("placement");
  double error_px = motion->standard_error_px;
  if (work_.out.alignment != MergeAlignment::none) error_px += predicts() ? predicted_error_px : cell_error_px;
  merge::Comparison found =
      work_.compared(placed, merge::noise_in_light(frame.variance_e2, use.light),
                     {.block_false_alarm = work_.options.false_alarm, .displacement_error_px = error_px}, index);
  if (is_least)
    bracket_->set_matches(found.block_matches.empty() ? Plane<std::uint8_t>() : found.block_matches.clone());
  add_matching({frame, *motion, use.light, differences, placed, site_weight}, found.block_matches, index);
  work_.clock.lap("mean");
  return {};
}

/// Returns the motion of a frame, and states it; nullopt if it is too uncertain to use the frame.
std::optional<merge::Motion> MovedMerge::motion_of(const FrameElectrons& frame, double light, int index) {
  FrameUse& use = work_.out.frames[static_cast<std::size_t>(index)];
  std::optional<merge::Motion> motion = measured_motion(frame, light, index);
  work_.clock.lap("alignment");
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

std::optional<merge::Motion> MovedMerge::measured_motion(const FrameElectrons& frame, double light, int index) {
  if (work_.out.alignment == MergeAlignment::none || index == work_.out.reference) {
    return merge::no_motion(work_.width, work_.height);
  }
  if (by_stars()) {
    return stars_->motion_of(view_of(frame), work_.out.frames[static_cast<std::size_t>(index)], work_.executor);
  }
  if (auto known = known_motions_.extract(index)) return std::move(known.mapped());
  return with_unshaded(frame, work_.executor, [&](const merge::FrameView& view) {
    return merge::find_motion(*tiles_, view, light, {}, work_.executor);
  });
}

/// Adds a frame where it matches.
void MovedMerge::add_matching(const MovedFrame& moved, Plane<std::uint8_t>& matches, int index) {
  if (drizzle_) {
    drizzle_->add({.frame = view_of(moved.frame),
                   .motion = moved.motion,
                   .level_e = level_e_,
                   .accepted = {std::as_const(matches).view(), merge::block_px}},
                  work_.executor);
    return;
  }
  const auto part = [&](const Plane<std::uint8_t>& blocks) {
    return merge::MeanPart{moved.site_weight.view(), blocks.view()};
  };
  const bool as_drops = work_.out.alignment == MergeAlignment::subpixel || by_stars();
  if (!as_drops || index == work_.out.reference) {
    merge::add_placed(moved.placed.view(), part(matches), *mean_, work_.executor);
    return;
  }
  const Plane<std::uint8_t> still = still_.empty() ? Plane<std::uint8_t>() : take_still_blocks(matches);
  add_drops(moved, part(matches));
  add_colours(moved, std::as_const(matches).view());
  if (!still.empty()) merge::add_placed(moved.placed.view(), part(still), *mean_, work_.executor);
}

/// Adds the differences of a frame to the mean of all colours.
void MovedMerge::add_colours(const MovedFrame& moved, PlaneView<const std::uint8_t> block_matches) {
  if (!colours_ || colour_frames_ == merge::ColourMean::max_frames) return;
  merge::add_colour_drops(moved.differences.view(), work_.reference.phase, moved.motion, expected(), block_matches,
                          *colours_, work_.executor);
  ++colour_frames_;
}

/// Adds the values of a frame as drops: those of stars as they are, others as differences to the prediction.
void MovedMerge::add_drops(const MovedFrame& moved, const merge::MeanPart& part) {
  if (by_stars()) divide(moved.frame.signal_e, moved.light, work_.executor);
  const std::array<double, 3> noise = merge::add_drops(
      by_stars() ? std::as_const(moved.frame.signal_e).view() : moved.differences.view(), work_.reference.phase,
      moved.motion, by_stars() ? RgbView<const float>{} : expected(), drop_radius_px_, part, *mean_, work_.executor);
  const double used = used_share(part.block_matches);
  frames_used_ += used;
  for (std::size_t c = 0; c < 3; ++c) excess_noise_[c] += used * (noise[c] - 1);
}

/// Removes the blocks that stand still from those that match. @return those that were removed
Plane<std::uint8_t> MovedMerge::take_still_blocks(Plane<std::uint8_t>& matches) const {
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

/// Returns the mean signal of each site.
PerSite<double> MovedMerge::mean_level_e() const {
  PerSite<double> sum{}, sites{};
  for (int y = 0; y < work_.height; ++y) {
    for (int x = 0; x < work_.width; ++x) {
      const float value = work_.reference.signal_e.at(x, y);
      if (!std::isfinite(value)) continue;
      sum[site_of(x, y)] += static_cast<double>(value);
      sites[site_of(x, y)] += 1;
    }
  }
  for (int i = 0; i < 4; ++i) sum[i] = sites[i] > 0 ? std::max(sum[i] / sites[i], 0.0) : 0;
  return sum;
}

}  // namespace lowlux::isp
