#include "isp/bench/stages/methods_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/accuracy_time.h"
#include "isp/bench/methods/method_frame.h"
#include "isp/bench/methods/method_scenes.h"

namespace lowlux::isp {
namespace {

constexpr int part_px = 256;
constexpr const char* stage = "methods";

std::string image_id(const std::string& method) {
  std::string out = fmt::format("{}-{}", stage, method);
  std::ranges::replace_if(
      out, [](char c) { return c == '.' || c == '_'; }, '-');
  return out;
}

std::vector<Plot> plots_of(std::span<const MethodRow> rows) {
  std::vector<AccuracyRow> timed;
  for (const MethodRow& row : rows) {
    if (!std::isfinite(row.ms_per_mp)) continue;
    timed.push_back({.group = row.light + " e-",
                     .error_of = "mean CIEDE2000 against the truth",
                     .level = row.method,
                     .error = row.score.error.ciede2000,
                     .ms_per_mp = row.ms_per_mp,
                     .undominated = row.undominated});
  }
  return accuracy_plots(stage, timed);
}

/// Adds each method's part, compared with the noisy one.
void add_parts(std::vector<MethodPart> parts, BenchOutcome& out) {
  for (MethodPart& part : parts) {
    std::string id = image_id(part.method);
    while (std::ranges::find(out.images, id, &BenchImage::id) != out.images.end()) id += "-2";
    if (part.method != name_of_noisy) {
      out.comparisons.push_back({part.method, image_id(name_of_noisy), name_of_noisy, id, part.method});
    }
    out.images.push_back({std::move(id), std::move(part.codes)});
  }
}

std::string joined(std::span<const MethodScene> scenes) {
  std::string out;
  for (const MethodScene& scene : scenes) {
    const SceneLinear& image = scene.picture.linear;
    out += fmt::format("{}{} {} x {}", out.empty() ? "" : ", ", scene.picture.name, image.width(), image.height());
  }
  return out;
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t seed_step = 1000003;  // seeds of frames differ between seeds of the bench

/// One frame that all methods are given.
struct Frame {
  const MethodScene& scene;
  const PictureTruth& truth;
  DenoiseShot shot;
  double megapixels = 0;
};

/// Sums of one method in one light.
class Sums {
 public:
  void add(const MethodScore& score, const CommandUse& use, double megapixels) {
    const auto add_to = [this](double& sum, double value) { sum += value / scenes_; };
    PictureError& error = score_.error;
    add_to(error.psnr_db, score.error.psnr_db);
    add_to(error.ciede2000, score.error.ciede2000);
    add_to(error.box_chroma_rmse, score.error.box_chroma_rmse);
    add_to(score_.chroma_bias, score.chroma_bias);
    add_to(score_.texture_kept, score.texture_kept);
    saturation_.add(score.error.saturation_ratio);
    stars_.add(score.stars_kept);
    wall_s_ += use.wall_s;
    cpu_s_ += use.cpu_s;
    peak_bytes_ = std::isnan(use.peak_bytes) ? nan : std::max(peak_bytes_, use.peak_bytes);
    megapixels_ += megapixels;
  }
  explicit Sums(std::size_t scenes) : scenes_(static_cast<double>(scenes)) {}

  /// @param run_as  empty: nothing was run, and there are no times
  MethodRow row(const std::string& light, const std::string& method, const std::string& run_as) const {
    MethodRow out{.light = light, .method = method, .run_as = run_as, .score = score_};
    out.score.error.saturation_ratio = saturation_.mean();
    out.score.stars_kept = stars_.mean();
    const bool was_run = !run_as.empty();
    out.ms_per_mp = was_run ? 1e3 * wall_s_ / megapixels_ : nan;
    out.cpu_ms_per_mp = was_run ? 1e3 * cpu_s_ / megapixels_ : nan;
    out.peak_mib = was_run ? peak_bytes_ / (1 << 20) : nan;
    return out;
  }

 private:
  /// Mean of the values that are numbers.
  struct Mean {
    double sum = 0;
    int count = 0;
    void add(double value) {
      if (!std::isfinite(value)) return;
      sum += value;
      ++count;
    }
    double mean() const { return count > 0 ? sum / count : nan; }
  };

  double scenes_;
  MethodScore score_{};
  Mean saturation_, stars_;
  double wall_s_ = 0, cpu_s_ = 0, peak_bytes_ = 0, megapixels_ = 0;
};

class Bench {
 public:
  Bench(std::vector<MethodScene> scenes, const BenchOptions& options)
      : options_(options), scenes_(std::move(scenes)), executor_(options.threads) {
    int width = 0;
    truths_.reserve(scenes_.size());
    for (const MethodScene& scene : scenes_) {
      width = std::max(width, scene.picture.linear.width());
      truths_.emplace_back(scene.picture.linear.view(), executor_);
    }
    renderer_.emplace(width, executor_);
  }

  void run(const DenoiseLight& light) {
    const std::string name = lowlux::isp::name_of(light);
    Sums ceiling(scenes_.size()), noisy(scenes_.size());
    std::map<std::string, Sums> sums;
    for (std::size_t i = 0; i < scenes_.size(); ++i) {
      const MethodScene& scene = scenes_[i];
      Frame frame{scene, truths_[i], take(scene.picture, light, frame_seed(i, light)),
                  1e-6 * static_cast<double>(scene.picture.linear.plane[0].size())};
      ceiling.add(score(frame, renderer_->render(frame.shot.signal_e.view(), frame.shot, NoiseLeft::none)), {}, 1);
      const MethodImage given(noisy_frame(frame.shot));
      const auto& raw = std::get<RawFrame>(given);
      if (auto seen = rendered(given, frame.shot, scene.picture.linear, *renderer_)) {
        noisy.add(score(frame, *seen), {}, 1);
        keep_part(name, i, name_of_noisy, *seen);
      }
      for (const ScoredMethod& method : options_.methods) {
        run(method, raw, frame, name, i, sums.try_emplace(method.name, scenes_.size()).first->second);
        options_.advance(1.0 / work_items(), method.name + " at " + name);
      }
    }
    rows_.push_back(ceiling.row(name, name_of_noise_free, ""));
    rows_.push_back(noisy.row(name, name_of_noisy, ""));
    for (const ScoredMethod& method : options_.methods) {
      if (failed_.contains(method.name)) continue;
      const char* const run_as = method.command.empty() ? "function" : "program";
      rows_.push_back(sums.at(method.name).row(name, method.name, run_as));
    }
  }

  BenchOutcome outcome(const std::vector<DenoiseLight>& lights) {
    std::erase_if(rows_, [this](const MethodRow& row) { return failed_.contains(row.method); });
    std::erase_if(parts_, [this](const MethodPart& part) { return failed_.contains(part.method); });
    rank_methods(rows_);
    BenchOutcome out = methods_outcome(rows_, std::move(parts_));
    out.failures = std::move(failures_);
    out.settings = methods_settings(options_, scenes_, lights);
    return out;
  }

  void set_lights(std::size_t count) { lights_ = count; }

 private:
  double work_items() const {
    return static_cast<double>(std::max<std::size_t>(1, options_.methods.size()) * scenes_.size() * lights_);
  }
  std::uint64_t frame_seed(std::size_t scene, const DenoiseLight& light) const {
    return seed_step * options_.seed + 1000 * scene + static_cast<std::uint64_t>(light.mean_e);
  }
  MethodScore score(const Frame& frame, const RenderedPicture& picture) {
    return score_of(picture, frame.truth, frame.scene, executor_);
  }

  /// Runs one method on one frame, unless it has failed before.
  void run(const ScoredMethod& method, const RawFrame& raw, const Frame& frame, const std::string& light,
           std::size_t scene, Sums& sums) {
    if (failed_.contains(method.name)) return;
    auto done = run_method(method, raw, options_.command_limits, executor_);
    auto picture = done ? rendered(done->image, frame.shot, frame.scene.picture.linear, *renderer_)
                        : Result<RenderedPicture>(tl::make_unexpected(done.error()));
    if (!picture) {
      failed_.insert(method.name);
      failures_.push_back({picture.error().code,
                           fmt::format("{} (scene {}, {} e-); it is left out", picture.error().message,
                                       frame.scene.picture.name, light),
                           "method " + method.name});
      return;
    }
    sums.add(score(frame, *picture), done->use, frame.megapixels);
    keep_part(light, scene, method.name, *picture);
  }

  void keep_part(const std::string& light, std::size_t scene, const std::string& method,
                 const RenderedPicture& picture) {
    if (light == shown_light() && scene == 0) parts_.push_back({method, middle_codes(picture.display)});
  }
  static std::string shown_light() { return lowlux::isp::name_of(methods_lights(true).front()); }

  const BenchOptions& options_;
  std::vector<MethodScene> scenes_;
  PoolExecutor executor_;
  std::vector<PictureTruth> truths_;
  std::optional<BenchRenderer> renderer_;
  std::size_t lights_ = 1;
  std::vector<MethodRow> rows_;
  std::vector<MethodPart> parts_;
  std::set<std::string> failed_;
  std::vector<Error> failures_;
};

constexpr SceneSize whole_size{512, 384}, quick_size{256, 256};

}  // namespace

Encoded8 middle_codes(const SceneLinear& display) {
  const int width = std::min(part_px, display.width()), height = std::min(part_px, display.height());
  const int x0 = (display.width() - width) / 2, y0 = (display.height() - height) / 2;
  RgbView<const float> part;
  for (std::size_t c = 0; c < 3; ++c) part[c] = display.plane[c].view().crop(x0, y0, width, height);
  return codes_of(part);
}

std::vector<DenoiseLight> methods_lights(bool quick) {
  constexpr DenoiseLight bright{200, 2, 1.5}, dim{20, 2, 1.5}, dark{4, 2, 1.5};
  if (quick) return {dim};
  return {bright, dim, dark};
}

BenchOutcome methods_outcome(std::span<const MethodRow> rows, std::vector<MethodPart> parts) {
  BenchOutcome out{.table = methods_table(rows), .plots = plots_of(rows)};
  add_parts(std::move(parts), out);
  out.remarks = {
      "Every method gets the same raw frames, each in a private folder; the truth is not written to a file",
      "Rows are means over the scenes. The rank is that of PSNR; noise-free is the mosaic without noise, noisy the "
      "input. Raw output is rendered as that of lowlux; an image is scaled to the mean luminance of the truth first",
      "saturation, texture and stars kept are slopes of a regression on the truth; 1 is ideal. chroma bias is the "
      "length of the mean difference in a*, b*; blotches are the RMS difference in a*, b* of means over 16 x 16 pixels",
      "Times are wall-clock times of one run for each frame; those of programs include their start and file access, "
      "those of functions do not. Peak memory is that of the largest process of a program"};
  return out;
}

std::vector<BenchSetting> methods_settings(const BenchOptions& options, std::span<const MethodScene> scenes,
                                           std::span<const DenoiseLight> lights) {
  std::vector<BenchSetting> out{
      {"seed", fmt::format("{}", options.seed)},
      {"pictures", fmt::format("{}{}", name_of(options.pictures), options.quick ? ", quick" : "")},
      {"scenes", joined(scenes)},
      {"sensor", fmt::format("RGGB, 16 bits, white balance gains {:g}, {:g}, {:g}, black level with dark charge, "
                             "NoiseProfile stated",
                             bench_white_gain[0], bench_white_gain[1], bench_white_gain[2])}};
  for (const DenoiseLight& light : lights) {
    out.push_back({fmt::format("light {}", name_of(light)),
                   fmt::format("mean signal {:g} e-, dark charge {:g} e-, read noise {:g} e-", light.mean_e,
                               light.dark_e, light.read_noise_e)});
  }
  out.push_back({"limits", fmt::format("{:g} s, {} MiB of a file, {} MiB of memory", options.command_limits.max_wall_s,
                                       options.command_limits.max_file_bytes >> 20,
                                       options.command_limits.max_memory_bytes >> 20)});
  for (const ScoredMethod& method : options.methods) {
    out.push_back({"method " + method.name, method.command.empty() ? "a function of Python" : method.command});
  }
  return out;
}

Result<BenchOutcome> run_methods_bench(const BenchOptions& options) {
  std::vector<DenoiseLight> lights = methods_lights(options.quick);
  if (options.shard.number > lights.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("shard {} of {} is empty: there are {} light levels", options.shard.number,
                            options.shard.count, lights.size()),
                "--shard");
  }
  options.shard.select(lights);
  PoolExecutor executor(options.threads);
  const SceneSize size = options.quick ? quick_size : whole_size;
  const auto files = options.quick ? quick_files_of(options.pictures) : files_of(options.pictures);
  auto scenes = method_scenes(options.pictures_folder, files, size, options.seed, executor);
  if (!scenes) return tl::make_unexpected(scenes.error());
  Bench bench(*std::move(scenes), options);
  bench.set_lights(lights.size());
  for (const DenoiseLight& light : lights) bench.run(light);
  return bench.outcome(lights);
}

void rank_methods(std::vector<MethodRow>& rows) {
  const auto ranked = [](const MethodRow& row) { return row.method != name_of_noise_free; };
  std::vector<std::string> lights;
  for (const MethodRow& row : rows) {
    if (std::ranges::find(lights, row.light) == lights.end()) lights.push_back(row.light);
  }
  const auto place = [&](const MethodRow& row) { return std::ranges::find(lights, row.light) - lights.begin(); };
  std::ranges::stable_sort(rows, [&](const MethodRow& a, const MethodRow& b) {
    if (a.light != b.light) return place(a) < place(b);
    if (ranked(a) != ranked(b)) return !ranked(a);
    return a.score.error.psnr_db > b.score.error.psnr_db;
  });
  std::vector<AccuracyRow> timed;
  int rank = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == 0 || rows[i].light != rows[i - 1].light) rank = 0;
    rows[i].rank = ranked(rows[i]) ? ++rank : 0;
    if (!std::isfinite(rows[i].ms_per_mp)) continue;
    timed.push_back({.group = rows[i].light,
                     .level = rows[i].method,
                     .error = rows[i].score.error.ciede2000,
                     .ms_per_mp = rows[i].ms_per_mp});
  }
  mark_undominated(timed);
  for (const AccuracyRow& row : timed) {
    const auto at =
        std::ranges::find_if(rows, [&](const MethodRow& r) { return r.light == row.group && r.method == row.level; });
    at->undominated = row.undominated;
  }
}

BenchTable methods_table(std::span<const MethodRow> rows) {
  BenchTable table{
      {"light [e-/e-]", "rank", "method", "run as", "PSNR [dB]", "CIEDE2000", "saturation kept", "chroma bias",
       "blotches", "texture kept", "stars kept", "time [ms/MP]", "CPU [ms/MP]", "peak memory [MiB]", "undominated"},
      {}};
  table.rows.reserve(rows.size());
  for (const MethodRow& row : rows) {
    const PictureError& error = row.score.error;
    table.rows.push_back({row.light, row.rank > 0 ? fmt::format("{}", row.rank) : std::string(), row.method, row.run_as,
                          error.psnr_db, error.ciede2000, error.saturation_ratio, row.score.chroma_bias,
                          error.box_chroma_rmse, row.score.texture_kept, row.score.stars_kept, row.ms_per_mp,
                          row.cpu_ms_per_mp, row.peak_mib, std::string(row.undominated ? "yes" : "")});
  }
  return table;
}

}  // namespace lowlux::isp
