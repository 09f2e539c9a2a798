#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/synthetic/burst.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/cost/timing_frame.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/merge/merge_frames.h"

namespace lowlux::isp {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr double dn_per_e = 4, black_dn = 1024, white_dn = 16383;
constexpr int border_px = 48;  // more than any displacement: what other frames show too
constexpr int area_px = 16;    // side of the areas whose means are judged

/// Describes the light of a burst: mean signal and dark charge of a pixel of frame 0 [e-]; read noise is 2 e-.
struct MergeLight {
  const char* name;
  double mean_e;
  double dark_e;
};
constexpr std::array merge_lights{MergeLight{"20 e-", 20, 0}, MergeLight{"4 e-", 4, 0},
                                  MergeLight{"20 e- over 200 e- of dark charge", 20, 200}};

/// Describes how a burst is merged; frames 1: the first frame alone.
struct MergeLevel {
  const char* name;
  MergeOptions options;
  int frames;
};

struct MergeMotion {
  const char* name;
  capture::BurstOptions burst;
};

capture::BurstOptions hand_held() {
  capture::BurstOptions burst;
  burst.shake_px = 40;
  burst.roll_deg = 1.5;
  burst.movers = 3;
  burst.mover_size_px = 40;
  burst.reduction = 2;
  return burst;
}

capture::BurstOptions on_a_tripod() {
  capture::BurstOptions burst;
  burst.reduction = 2;
  return burst;
}

/// A camera of read noise 2 e-, 4 DN/e- and the dark charge of a light in its exposure of 0.05 s.
NamedSensor merge_camera(double dark_e) {
  NamedSensor camera = bench_camera();
  SensorModel& model = camera.model;
  model.system_gain_dn_per_e = dn_per_e;
  model.read_noise_e = 2;
  model.bits = 14;
  model.black_level_dn = black_dn;
  model.white_level_dn = white_dn;
  model.full_well_e = (white_dn - black_dn) / dn_per_e;
  model.dark_current_e_per_s = {dark_e / 0.05, dark_e / 0.05, dark_e / 0.05};
  model.prnu = model.dsnu = model.hot_pixel_fraction = model.row_noise_e = model.column_noise_e = 0;
  return camera;
}

struct SimulatedBurst {
  std::vector<RawFrame> frames;
  Plane<float> mosaic_e;  // truth of frame 0
  SceneLinear xyz;
  Plane<std::uint8_t> moved;  // 1 where an object was in any frame
  double dark_e = 0;
};

double mean_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  return sum / static_cast<double>(plane.size());
}

Plane<std::uint8_t> moved_mask(const capture::BurstSource& source, int frames, int width, int height) {
  Plane<std::uint8_t> mask(width, height);
  std::fill_n(mask.data(), mask.size(), std::uint8_t{0});
  for (int i = 0; i < frames; ++i) {
    for (const capture::ImageBox& box : source.truth(static_cast<std::uint32_t>(i)).movers) {
      const int left = std::max(0, static_cast<int>(box.left_px) - 1),
                top = std::max(0, static_cast<int>(box.top_px) - 1);
      const int right = std::min(width, static_cast<int>(box.right_px) + 2);
      const int bottom = std::min(height, static_cast<int>(box.bottom_px) + 2);
      for (int y = top; y < bottom; ++y)
        std::fill(mask.row(y) + left, mask.row(y) + std::max(left, right), std::uint8_t{1});
    }
  }
  return mask;
}

Result<capture::BurstSource> source_of(const BenchPicture& picture, const MergeLight& light,
                                       const capture::BurstOptions& burst, double luminance_cd_m2, Executor& executor) {
  capture::SyntheticOptions options;
  options.exposure = {.time_s = 0.05, .temperature_c = 20};
  options.seed = 26;
  return capture::BurstSource::of(bench_scene(picture, luminance_cd_m2), merge_camera(light.dark_e), bench_response(),
                                  options, burst, executor);
}

/// Makes the mean dark charge part of the black level that a frame states, and its noise part of the NoiseProfile.
void state_dark_charge(RawFrame& frame, double dark_e) {
  frame.raw.black_tag = BlackLevel{.pattern_dn = {black_dn + dn_per_e * dark_e}};
  NoiseProfile& noise = frame.noise.value();
  const double range = (white_dn - black_dn) / (white_dn - black_dn - dn_per_e * dark_e);
  for (std::size_t c = 0; c < 3; ++c) {
    noise.offset[c] = (noise.offset[c] + dark_e * noise.scale[c] * noise.scale[c]) * range * range;
    noise.scale[c] *= range;
  }
}

Result<SimulatedBurst> simulated(const BenchPicture& picture, const MergeLight& light,
                                 const capture::BurstOptions& burst, int frames, Executor& executor) {
  auto unit = source_of(picture, light, burst, 1, executor);
  if (!unit) return tl::make_unexpected(unit.error());
  const double luminance_cd_m2 = light.mean_e / mean_of(unit->mosaic_e(0, executor));
  auto source = source_of(picture, light, burst, luminance_cd_m2, executor);
  if (!source) return tl::make_unexpected(source.error());
  SimulatedBurst out{.dark_e = light.dark_e};
  for (int i = 0; i < frames; ++i) {
    auto frame = source->frame(static_cast<std::uint32_t>(i), executor);
    if (!frame) return tl::make_unexpected(frame.error());
    state_dark_charge(*frame, light.dark_e);
    out.frames.push_back(*std::move(frame));
  }
  out.mosaic_e = source->mosaic_e(0, executor);
  out.xyz = source->xyz_cd_m2(0, executor);
  for (Plane<float>& plane : out.xyz.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] /= static_cast<float>(luminance_cd_m2);
  }
  out.moved = moved_mask(*source, frames, out.mosaic_e.width(), out.mosaic_e.height());
  return out;
}

DevelopOptions merge_develop_options() {
  DevelopOptions options{.estimate_dark = false, .find_defects = false};
  options.denoise.line_noise = false;
  return options;
}

/// Mean squared error of a raw frame [e-^2], without its border.
struct MosaicError {
  double still = 0;
  double moved = missing;   // where objects were
  double stated = missing;  // mean variance that the frame states, where nothing moved
  /// Variance that the frame states for the means of R, G and B over areas in which nothing moved, over their
  /// mean squared error.
  double stated_of_areas = missing;
};

/// Sums of errors and of stated variances of R, G and B over one area.
struct AreaSums {
  std::array<double, 3> error{}, stated{};
  bool moved = false;
};

double stated_of_areas(const Plane<AreaSums>& areas) {
  double stated = 0, squares = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const AreaSums& area = areas.data()[i];
    if (area.moved) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      stated += area.stated[c];
      squares += area.error[c] * area.error[c];
    }
  }
  return squares > 0 ? stated / squares : missing;
}

MosaicError error_of(const RawFrame& frame, const SimulatedBurst& burst) {
  const double black = frame.raw.black_tag->pattern_dn[0], white = frame.raw.white_dn[1];
  const double white_e = (white_dn - black_dn) / dn_per_e - burst.dark_e;
  std::array<double, 2> sum{}, count{};
  double stated = 0;
  const NoiseRatioView ratio = view_of(frame.noise_ratio.get());
  const auto areas_along = [](int px) { return (std::max(px - 2 * border_px, 1) + area_px - 1) / area_px; };
  Plane<AreaSums> areas(areas_along(frame.raw.dn.width()), areas_along(frame.raw.dn.height()));
  std::fill_n(areas.data(), areas.size(), AreaSums{});
  for (int y = border_px; y < frame.raw.dn.height() - border_px; ++y) {
    for (int x = border_px; x < frame.raw.dn.width() - border_px; ++x) {
      const double value = (frame.raw.dn.at(x, y) - black) / (white - black) * white_e;
      const auto truth = static_cast<double>(burst.mosaic_e.at(x, y));
      const std::size_t moved = burst.moved.at(x, y);
      sum[moved] += (value - truth) * (value - truth);
      count[moved] += 1;
      const auto c = static_cast<std::size_t>(colour_at(frame.raw.phase, x, y));
      const double variance = static_cast<double>(ratio.at(x, y)) *
                              (frame.noise->scale[c] * truth / white_e + frame.noise->offset[c]) * white_e * white_e;
      AreaSums& area = areas.at((x - border_px) / area_px, (y - border_px) / area_px);
      area.error[c] += value - truth;
      area.stated[c] += variance;
      area.moved = area.moved || moved != 0;
      if (moved == 0) stated += variance;
    }
  }
  MosaicError out{.still = sum[0] / count[0], .stated = stated / count[0], .stated_of_areas = stated_of_areas(areas)};
  if (count[1] > 0) out.moved = sum[1] / count[1];
  return out;
}

/// Develops a frame to XYZ and compares it with the truth.
Result<PictureComparison> compared(const RawFrame& frame, const SimulatedBurst& burst,
                                   std::optional<denoise::Level> level, Executor& executor) {
  DevelopOptions options = merge_develop_options();
  options.space = OutputSpace::xyz;
  options.samples = SampleType::f32;
  options.tone = ToneCurve::none;
  options.exposure_ev = 0;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::automatic;
  if (level) options.denoise.level = *level;
  auto developed = develop(frame, options, executor);
  if (!developed) return tl::make_unexpected(developed.error());
  auto& xyz = std::get<SceneLinear>(developed->picture);
  const double gain = mean_of(burst.xyz.plane[1]) / mean_of(xyz.plane[1]);
  for (Plane<float>& plane : xyz.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] *= static_cast<float>(gain);
  }
  return compare_pictures(burst.xyz, xyz, executor);
}

class Rows {
 public:
  Rows(const MergeLight& light, const MergeMotion& motion, const std::string& scene, SimulatedBurst burst,
       Executor& executor)
      : light_(light), motion_(motion), scene_(scene), burst_(std::move(burst)), executor_(executor) {}

  Result<void> add_single(BenchTable& table) {
    single_ = error_of(burst_.frames[0], burst_);
    const auto best = compared(burst_.frames[0], burst_, denoise::Level::best, executor_);
    if (!best) return tl::make_unexpected(best.error());
    table.rows.push_back(row("one frame, developed with best", 1, single_, *best, missing));
    return {};
  }

  Result<void> add(const MergeLevel& level, BenchTable& table) {
    const FrameReader read = [&](int index, bool) {
      return Result<FrameToMerge>({copy_of(burst_.frames[static_cast<std::size_t>(index)]), merge_develop_options()});
    };
    const auto start = std::chrono::steady_clock::now();
    auto merged = merge_frames(level.frames, read, level.options, executor_);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!merged) return tl::make_unexpected(merged.error());
    const MosaicError error = error_of(merged->frame, burst_);
    const auto picture = compared(merged->frame, burst_, std::nullopt, executor_);
    if (!picture) return tl::make_unexpected(picture.error());
    const double megapixels = 1e-6 * burst_.mosaic_e.width() * burst_.mosaic_e.height();
    table.rows.push_back(row(level.name, level.frames, error, *picture, 1e3 * seconds / (megapixels * level.frames)));
    return {};
  }

 private:
  std::vector<BenchCell> row(const char* level, int frames, const MosaicError& error, const PictureComparison& picture,
                             double ms_per_mp) const {
    const auto gain_db = [](double before, double after) { return 10 * std::log10(before / after); };
    return {scene_,
            light_.name,
            motion_.name,
            level,
            static_cast<double>(frames),
            gain_db(single_.still, error.still),
            10 * std::log10(frames),
            gain_db(single_.moved, error.moved),
            error.stated / error.still,
            error.stated_of_areas,
            picture.psnr_db,
            picture.ciede2000.mean,
            ms_per_mp};
  }

  const MergeLight& light_;
  const MergeMotion& motion_;
  const std::string& scene_;
  SimulatedBurst burst_;
  Executor& executor_;
  MosaicError single_;
};

std::vector<MergeLevel> levels_of(bool moves, bool quick) {
  std::vector<MergeLevel> out;
  const std::vector<int> counts = quick ? std::vector{8} : std::vector{4, 8, 16, 32};
  for (const int frames : counts) {
    if (moves) {
      out.push_back({"plain mean", {.robust = false, .alignment = MergeAlignment::none}, frames});
      out.push_back({"robust", {.alignment = MergeAlignment::none}, frames});
      out.push_back({"aligned, plain mean", {.robust = false, .alignment = MergeAlignment::cells}, frames});
      out.push_back({"aligned", {.alignment = MergeAlignment::cells}, frames});
      out.push_back({"sub-pixel, plain mean", {.robust = false, .alignment = MergeAlignment::subpixel}, frames});
      out.push_back({"aligned, sub-pixel", {.alignment = MergeAlignment::subpixel}, frames});
    } else {
      out.push_back({"plain mean", {.robust = false, .alignment = MergeAlignment::none}, frames});
      out.push_back({"robust", {.alignment = MergeAlignment::none}, frames});
    }
  }
  return out;
}

/// Draws the mean gain of each way over the number of frames.
Plot gain_over_frames(const BenchTable& table) {
  Plot out{.id = "gain",
           .title = "Gain before denoising",
           .x_label = "frames",
           .y_label = "gain [dB]",
           .caption = "Means over scenes and lights."};
  std::map<std::pair<std::string, double>, std::pair<double, int>> sums;  // by way and frames: sum, count
  std::vector<std::string> ways;
  for (const std::vector<BenchCell>& row : table.rows) {
    const double frames = std::get<double>(row[4]);
    if (frames == 1) continue;
    const std::string way = std::get<std::string>(row[2]) + ": " + std::get<std::string>(row[3]);
    if (std::ranges::find(ways, way) == ways.end()) ways.push_back(way);
    auto& [sum, count] = sums[{way, frames}];
    sum += std::get<double>(row[5]);
    ++count;
  }
  for (const std::string& way : ways) {
    Series series{.name = way, .mark = Mark::points};
    for (const auto& [key, sum] : sums) {
      if (key.first != way) continue;
      series.x.push_back(key.second);
      series.y.push_back(sum.first / sum.second);
    }
    out.series.push_back(std::move(series));
  }
  return out;
}

}  // namespace

Result<BenchOutcome> run_merge_bench(const BenchOptions& options) {
  BenchOutcome out;
  out.threads = options.threads;
  out.table.columns = {"scene",
                       "light",
                       "camera",
                       "level",
                       "frames",
                       "gain before denoising [dB]",
                       "10 log10 N [dB]",
                       "gain where objects moved [dB]",
                       "stated variance / error",
                       "stated variance / error of areas",
                       "PSNR developed [dB]",
                       "CIEDE2000",
                       "time [ms per MP and frame]"};
  PoolExecutor executor(options.threads);
  const auto pictures = read_bench_pictures(options, 0, 0, options.quick ? 1 : 3, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const std::array motions{MergeMotion{"at rest", on_a_tripod()},
                           MergeMotion{"hand-held, 3 objects move", hand_held()}};
  const std::span<const MergeLight> lights = std::span(merge_lights).first(options.quick ? 1 : merge_lights.size());
  const auto steps = static_cast<double>(pictures->size() * lights.size() * motions.size());
  for (const BenchPicture& picture : *pictures) {
    for (const MergeLight& light : lights) {
      for (const MergeMotion& motion : motions) {
        auto burst = simulated(picture, light, motion.burst, options.quick ? 8 : 32, executor);
        if (!burst) return tl::make_unexpected(burst.error());
        Rows rows(light, motion, picture.name, *std::move(burst), executor);
        if (auto added = rows.add_single(out.table); !added) return tl::make_unexpected(added.error());
        for (const MergeLevel& level : levels_of(motion.burst.moves(), options.quick)) {
          if (auto added = rows.add(level, out.table); !added) return tl::make_unexpected(added.error());
        }
        options.advance(1 / steps, picture.name);
      }
    }
  }
  out.plots = {gain_over_frames(out.table)};
  out.remarks = {
      fmt::format("bursts of a camera with 2 e- of read noise; images with a lens blur, reduced to half size; "
                  "hand-held: shifts of up to 40 px, rotation of up to 1.5 degrees; a border of {} px is not scored",
                  border_px),
      fmt::format("stated variance / error: for single pixels where nothing moved, and for means of R, G and B over "
                  "areas of {0} x {0} px, on which noise reduction is based",
                  area_px),
      "gain: error of one raw frame over that of the merged frame, both against the truth of frame 0; developed: with "
      "the level that develop chooses, PSNR of sRGB codes and mean CIEDE2000 against the scene"};
  return out;
}

}  // namespace lowlux::isp
