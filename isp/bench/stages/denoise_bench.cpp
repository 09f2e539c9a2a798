#include "isp/bench/stages/denoise_bench.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/scenes/patch_bound.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr int rounds = 5;
constexpr int slow_rounds = 3;  // of slow methods, with the first image alone
/// Central crops, used where a crop suffices: to tune other methods, and for quick runs.
constexpr PicturePart tuning_part{256, 160}, quick_part{192, 128};
constexpr int crop_px = 192;                        // side of an image's crop in the report
constexpr const char* compared_level = "standard";  // level compared with `none`
constexpr double search_fraction = 0.2;             // fraction of the total time

/// Input of all measurements: images in lights.
struct Work {
  const BenchOptions& options;
  std::vector<BenchPicture> pictures;
  std::vector<DenoiseLight> lights;
  std::vector<TunedParameters> tuned;     // one for each light
  std::vector<StrengthSearch> strengths;  // one for each image in each light, image by image

  std::size_t shots() const { return pictures.size() * lights.size(); }
};

StrengthSearch searched(const Work& work, std::size_t picture, std::size_t light) {
  InlineExecutor one;
  const BenchPicture& of = work.pictures[picture];
  const DenoiseShot shot = take(of, work.lights[light], seed_of(of, work.lights[light]));
  MethodMemory memory(of.linear.width(), of.linear.height(), one);
  const std::vector<DenoiseMethod> methods = denoise_methods(false);
  const auto none = std::find_if(methods.begin(), methods.end(),
                                 [](const DenoiseMethod& method) { return method.name == name_of_none; });
  const auto result = none->run({of, shot, work.tuned[light]}, none->level, memory);
  return search_strength(*work.options.nl_means, nl_means_input(result->picture), PictureTruth(of.linear.view(), one));
}

/// Distributes the searches over the executor's threads, one shot each.
Result<void> search_all(Work& work, Executor& executor) {
  work.strengths.resize(work.shots());
  for_each_index(executor, static_cast<int>(work.shots()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const std::size_t picture = i / work.lights.size(), light = i % work.lights.size();
    work.strengths[i] = searched(work, picture, light);
    work.options.advance(
        search_fraction / static_cast<double>(work.shots()),
        fmt::format("strengths for {} at {}", work.pictures[picture].name, name_of(work.lights[light])));
  });
  const bool failed = std::any_of(work.strengths.begin(), work.strengths.end(),
                                  [](const StrengthSearch& search) { return search.runs == 0; });
  if (failed) return fail(ErrorCode::unreadable, "OpenCV's fastNlMeansDenoising failed: not enough memory?");
  return {};
}

void add(PictureError& sum, const PictureError& error, double share) {
  sum.psnr_db += share * error.psnr_db;
  sum.ciede2000 += share * error.ciede2000;
  sum.chroma_rmse += share * error.chroma_rmse;
  sum.box_chroma_rmse += share * error.box_chroma_rmse;
  sum.uv_shift += share * error.uv_shift;
  sum.saturation_ratio += share * error.saturation_ratio;
}

/// Result of a method for the central crop of an image.
struct NamedPart {
  std::string name;
  Encoded8 codes;
};

Encoded8 side_by_side(const std::vector<NamedPart>& parts) {
  const int width = parts.front().codes.width(), height = parts.front().codes.height();
  Encoded8 out{Plane<std::uint8_t>(3 * width * static_cast<int>(parts.size()), height)};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (int y = 0; y < height; ++y) {
      std::copy_n(parts[i].codes.codes.row(y), 3 * width, out.codes.row(y) + 3 * width * static_cast<int>(i));
    }
  }
  return out;
}

std::string names_of(const std::vector<NamedPart>& parts) {
  std::string out;
  for (const NamedPart& part : parts) out += (out.empty() ? "" : ", ") + part.name;
  return out;
}

Encoded8 middle_codes(const SceneLinear& display) {
  const int width = std::min(crop_px, display.width()), height = std::min(crop_px, display.height());
  RgbView<const float> part = display.view();
  for (auto& plane : part) plane = plane.crop((plane.width - width) / 2, (plane.height - height) / 2, width, height);
  return codes_of(part);
}

/// Adds the images of a light to the report: all crops in a row, and two of them for comparison.
void add_pictures(const DenoiseLight& light, std::vector<NamedPart> parts, BenchOutcome& outcome) {
  const std::string id = fmt::format("denoise-{:g}-{:g}", light.mean_e, light.dark_e);
  outcome.images.push_back({id, side_by_side(parts)});
  for (NamedPart& part : parts) {
    if (part.name != name_of_none && part.name != compared_level) continue;
    outcome.images.push_back({id + "-" + part.name, std::move(part.codes)});
  }
  outcome.comparisons.push_back({.title = fmt::format("{:g} e- over {:g} e- of dark", light.mean_e, light.dark_e),
                                 .before_id = fmt::format("{}-{}", id, name_of_none),
                                 .before_label = "no noise reduction",
                                 .after_id = fmt::format("{}-{}", id, compared_level),
                                 .after_label = fmt::format("level {}", compared_level)});
}

/// Measures the rows of one light.
class LightRows {
 public:
  LightRows(const Work& work, std::size_t light, const std::vector<DenoiseMethod>& methods)
      : work_(work), light_(light), methods_(methods) {
    rows_.reserve(methods.size());
    spreads_.resize(methods.size());
    for (const DenoiseMethod& method : methods) {
      rows_.push_back({.method = method.name, .kind = method.kind, .light = work.lights[light]});
    }
  }

  Result<void> measure(std::size_t index, MethodMemory& memory, Executor& executor) {
    const BenchPicture& picture = work_.pictures[index];
    const DenoiseShot shot = take(picture, work_.lights[light_], seed_of(picture, work_.lights[light_]));
    const PictureTruth truth(picture.linear.view(), executor);
    const PatchBound patches(picture, shot);
    if (index == 0) parts.push_back({"truth", middle_codes(picture.linear)});
    MethodInput input{picture, shot, work_.tuned[light_], work_.options.nl_means};
    if (!work_.strengths.empty()) input.strength = work_.strengths[index * work_.lights.size() + light_].best;
    input.rounds = rounds;
    input.slow_rounds = index == 0 ? slow_rounds : 1;
    const double share = 1 / static_cast<double>(work_.pictures.size());
    const double megapixels = 1e-6 * static_cast<double>(shot.raw_e.size());
    for (std::size_t m = 0; m < methods_.size(); ++m) {
      const auto result = methods_[m].run(input, methods_[m].level, memory);
      if (!result) return tl::make_unexpected(result.error());
      add(rows_[m].error, picture_error(result->picture, truth, executor), share);
      rows_[m].patch_uv += share * patches.distance_uv(result->picture.light);
      rows_[m].patch_uv_bound += share * patches.bound_uv();
      rows_[m].s_per_mp += share * result->cpu_s / megapixels;
      rows_[m].times_memcpy += share * result->cpu_s / result->memcpy_s;
      if (std::isfinite(result->spread)) spreads_[m].push_back(result->spread);
      if (index == 0) parts.push_back({methods_[m].name, middle_codes(result->picture.display)});
    }
    return {};
  }

  std::vector<DenoiseRow> finished() {
    const auto nl_means =
        std::find_if(rows_.begin(), rows_.end(), [](const DenoiseRow& row) { return row.method == name_of_nl_means; });
    const double nl_means_s = nl_means == rows_.end() ? nan : nl_means->s_per_mp;
    for (std::size_t m = 0; m < rows_.size(); ++m) {
      rows_[m].speed_of_nlm = nl_means_s / rows_[m].s_per_mp;
      if (spreads_[m].empty()) continue;
      rows_[m].spread = std::reduce(spreads_[m].begin(), spreads_[m].end()) / static_cast<double>(spreads_[m].size());
    }
    mark_undominated(rows_);
    return std::move(rows_);
  }

  std::vector<NamedPart> parts;  // crops of the first image

 private:
  const Work& work_;
  std::size_t light_;
  const std::vector<DenoiseMethod>& methods_;
  std::vector<DenoiseRow> rows_;
  std::vector<std::vector<double>> spreads_;  // by row, of the images that have one
};

std::vector<std::string> remarks_of(const Work& work) {
  std::vector<std::string> out{fmt::format(
      "{} images ({}) with a lens blur of {} px, RGGB, white gains 2, 1, 1.5; means over the images",
      work.pictures.size(),
      fmt::format("{}{}", name_of(work.options.pictures), work.options.quick ? ", quick: crops of them" : ""),
      bench_lens_px)};
  out.push_back(
      fmt::format("Times: CPU time of one thread, median of {} rounds that alternate with memcpy; for best and {} of "
                  "{} rounds with the first image and one with each other image. Spread: half the interquartile range "
                  "over the median, mean over the images with several rounds; {}",
                  rounds, name_of_nl_means, slow_rounds, denoise::denoiser_target()));
  out.push_back(
      fmt::format("patch_uv: RMS distance in u'v' between means of {0} x {0} pixels and the truth, over patches whose "
                  "signal can be measured to a fifth. patch_uv_bound: its Cramer-Rao bound for unbiased methods that "
                  "use only the pixels of a patch",
                  bound_patch_px));
  for (std::size_t i = 0; i < work.lights.size(); ++i) {
    const TunedParameters& tuned = work.tuned[i];
    std::string line = fmt::format(
        "{}: on the tuning set, chromatic has radii {} (chroma) and {} (luminance), gat gains {:.2f}, {:.2f}, {:.2f}",
        name_of(work.lights[i]), tuned.windows.chroma_radius, tuned.windows.luminance_radius, tuned.stabilised_gain[0],
        tuned.stabilised_gain[1], tuned.stabilised_gain[2]);
    if (!work.strengths.empty()) {
      line += fmt::format(
          "; strengths of opencv-nlm (lightness, colour), optimised against the truth (of large images on a crop of {} "
          "x {}):",
          search_columns, search_rows);
    }
    for (std::size_t p = 0; p < work.pictures.size() && !work.strengths.empty(); ++p) {
      const NlMeansStrength& best = work.strengths[p * work.lights.size() + i].best;
      line +=
          fmt::format("{} {} {:.1f}, {:.1f}", p == 0 ? "" : ";", work.pictures[p].name, best.lightness, best.colour);
    }
    out.push_back(std::move(line));
  }
  if (work.options.nl_means == nullptr) out.push_back("opencv-nlm is left out: " + work.options.why_no_nl_means);
  return out;
}

Result<std::vector<DenoiseRow>> measure_all(const Work& work, Executor& executor, BenchOutcome& outcome) {
  const PicturePart largest = largest_of(work.pictures);
  MethodMemory memory(largest.width, largest.height, executor);
  const std::vector<DenoiseMethod> methods = denoise_methods(work.options.nl_means != nullptr);
  std::vector<DenoiseRow> rows;
  for (std::size_t light = 0; light < work.lights.size(); ++light) {
    LightRows of_light(work, light, methods);
    for (std::size_t picture = 0; picture < work.pictures.size(); ++picture) {
      if (const auto done = of_light.measure(picture, memory, executor); !done) {
        return tl::make_unexpected(done.error());
      }
      work.options.advance((1 - search_fraction) / static_cast<double>(work.shots()),
                           fmt::format("{} at {}", work.pictures[picture].name, name_of(work.lights[light])));
    }
    for (DenoiseRow& row : of_light.finished()) rows.push_back(std::move(row));
    if (light == 0)
      outcome.remarks.push_back("images denoise-LIGHT-DARK.png show, from left to right: " + names_of(of_light.parts));
    add_pictures(work.lights[light], std::move(of_light.parts), outcome);
  }
  return rows;
}

}  // namespace

Result<BenchOutcome> run_denoise_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const bool quick = options.quick;
  auto pictures = read_bench_pictures(options.pictures_folder,
                                      quick ? quick_files_of(options.pictures) : files_of(options.pictures),
                                      quick ? quick_part : PicturePart{}, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const auto tuning = read_bench_pictures(options.pictures_folder, files_of(PictureSet::tuning),
                                          quick ? quick_part : tuning_part, executor);
  if (!tuning) return tl::make_unexpected(tuning.error());
  Work work{options, *std::move(pictures), denoise_lights(options.quick), {}, {}};
  work.tuned.reserve(work.lights.size());
  for (const DenoiseLight& light : work.lights) {
    options.advance(0, "parameters of other methods at " + name_of(light));
    work.tuned.push_back(tune(*tuning, light, executor));
  }
  if (options.nl_means != nullptr) {
    if (const auto done = search_all(work, executor); !done) return tl::make_unexpected(done.error());
  }
  BenchOutcome out{.remarks = remarks_of(work)};
  const auto rows = measure_all(work, executor, out);
  if (!rows) return tl::make_unexpected(rows.error());
  out.table = denoise_table(*rows);
  out.findings = denoise_findings(*rows);
  out.plots = denoise_plots(*rows);
  return out;
}

namespace {

bool same_light(const DenoiseRow& a, const DenoiseRow& b) { return name_of(a.light) == name_of(b.light); }

bool dominates(const DenoiseRow& a, const DenoiseRow& b) {
  return a.s_per_mp <= b.s_per_mp && a.error.ciede2000 <= b.error.ciede2000 &&
         (a.s_per_mp < b.s_per_mp || a.error.ciede2000 < b.error.ciede2000);
}

BenchCell if_ceiling_none(const DenoiseRow& row, double value) { return row.kind == MethodKind::ceiling ? nan : value; }

/// Returns the rows of the light that begins at `first`.
std::span<const DenoiseRow> rows_of_light(std::span<const DenoiseRow> rows, std::size_t first) {
  std::size_t last = first;
  while (last < rows.size() && same_light(rows[first], rows[last])) ++last;
  return rows.subspan(first, last - first);
}

Plot plot_of(std::span<const DenoiseRow> rows) {
  const DenoiseLight& light = rows.front().light;
  Plot plot{.id = fmt::format("denoise-{:g}-{:g}", light.mean_e, light.dark_e),
            .title = fmt::format("{:g} e- over {:g} e- of dark", light.mean_e, light.dark_e),
            .x_label = "CPU time of one thread [s/MP]",
            .y_label = "mean CIEDE2000",
            .x_scale = AxisScale::logarithmic,
            .y_scale = AxisScale::linear};
  std::vector<std::pair<double, double>> front;
  std::string names;
  for (const DenoiseRow& row : rows) {
    if (row.kind == MethodKind::ceiling) continue;
    plot.series.push_back({row.method, {row.s_per_mp}, {row.error.ciede2000}, Mark::points});
    if (!row.undominated) continue;
    front.emplace_back(row.s_per_mp, row.error.ciede2000);
    names += (names.empty() ? "" : ", ") + row.method;
  }
  std::sort(front.begin(), front.end());
  Series line{"undominated", {}, {}, Mark::line};
  for (const auto& [time, error] : front) {
    line.x.push_back(time);
    line.y.push_back(error);
  }
  plot.series.push_back(std::move(line));
  plot.name_points = true;
  plot.caption = "Pareto-optimal rows: " + names;
  return plot;
}

}  // namespace

std::vector<DenoiseLight> denoise_lights(bool quick) {
  constexpr double small_dark_e = 2, small_read_e = 1.5, large_dark_e = 200, large_read_e = 4;
  constexpr double max_over_large_dark_e = 20;  // with more light, large dark charge gives the same image as small
  if (quick) return {{20, small_dark_e, small_read_e}, {4, large_dark_e, large_read_e}};
  std::vector<DenoiseLight> out;
  for (const double mean_e : {2000, 200, 20, 4, 1}) {
    out.push_back({mean_e, small_dark_e, small_read_e});
    if (mean_e <= max_over_large_dark_e) out.push_back({mean_e, large_dark_e, large_read_e});
  }
  return out;
}

void mark_undominated(std::span<DenoiseRow> rows) {
  for (DenoiseRow& row : rows) {
    row.undominated =
        row.kind != MethodKind::ceiling && std::none_of(rows.begin(), rows.end(), [&row](const DenoiseRow& other) {
          return other.kind != MethodKind::ceiling && same_light(row, other) && dominates(other, row);
        });
  }
}

BenchTable denoise_table(std::span<const DenoiseRow> rows) {
  BenchTable table{{"mean_e", "dark_e", "read_noise_e", "method", "psnr_db", "ciede2000", "chroma_rmse",
                    "box_chroma_rmse", "uv_shift", "patch_uv", "patch_uv_bound", "saturation_ratio", "s_per_mp",
                    "spread_percent", "times_memcpy", "speed_of_nlm", "undominated"},
                   {}};
  table.rows.reserve(rows.size());
  for (const DenoiseRow& row : rows) {
    const PictureError& e = row.error;
    table.rows.push_back({row.light.mean_e, row.light.dark_e, row.light.read_noise_e, row.method, e.psnr_db,
                          e.ciede2000, e.chroma_rmse, e.box_chroma_rmse, e.uv_shift, row.patch_uv, row.patch_uv_bound,
                          e.saturation_ratio, if_ceiling_none(row, row.s_per_mp),
                          if_ceiling_none(row, 100 * row.spread), if_ceiling_none(row, row.times_memcpy),
                          if_ceiling_none(row, row.speed_of_nlm), std::string(row.undominated ? "yes" : "")});
  }
  return table;
}

std::vector<Plot> denoise_plots(std::span<const DenoiseRow> rows) {
  std::vector<Plot> out;
  for (std::size_t first = 0; first < rows.size();) {
    const auto light = rows_of_light(rows, first);
    out.push_back(plot_of(light));
    first += light.size();
  }
  return out;
}

}  // namespace lowlux::isp
