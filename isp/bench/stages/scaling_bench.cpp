#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/develop_scene.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/picture/image_writer.h"
#include "isp/output/private_folder.h"
#include "isp/pipeline/develop.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::array sizes_mp{0.3, 1.0, 3.0, 12.0, 25.0, 50.0, 100.0};
constexpr std::size_t quick_sizes = 3;
/// Rounds of timing: fewer for large frames.
struct Rounds {
  int usual;
  int few;
  double few_from_mp;
};
constexpr Rounds full_rounds{5, 2, 25}, quick_rounds{2, 2, 3};
constexpr double memory_fraction = 0.4;  // fraction of the machine's memory that a frame may need
constexpr int files = 8;
constexpr double file_mp = 1;

struct PlanKind {
  const char* name;
  std::optional<Level> level;
};
constexpr std::array plan_kinds{PlanKind{"plain", {}}, PlanKind{"draft", Level::draft},
                                PlanKind{"standard", Level::standard}};

double largest_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

/// Resets the largest resident set to the current one. Returns false if the system does not support it.
bool forget_largest_resident() {
  const int file = open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  const bool forgotten = file >= 0 && write(file, "5", 1) == 1;
  if (file >= 0) close(file);
  return forgotten;
}

/// Runs the work in the child and sends the added memory to the parent.
[[noreturn]] void send_result(int to, const std::function<bool()>& work) {
  malloc_trim(0);  // freed memory would otherwise be reused and not counted
  const bool forgotten = forget_largest_resident();
  const double before = largest_resident_bytes();
  const double added = forgotten && work() ? largest_resident_bytes() - before : -1;
  const bool is_sent = write(to, &added, sizeof added) == static_cast<ssize_t>(sizeof added);
  _exit(is_sent ? 0 : 1);
}

/// Returns the physical memory of the machine [bytes].
double physical_bytes() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

DevelopOptions options_of(const PlanKind& plan) {
  DevelopOptions out;
  if (plan.level) out.denoise = {.mode = DenoiseChoice::Mode::level, .level = *plan.level};
  return out;
}

/// Returns a frame of 3 : 2, with even sides.
RawFrame frame_of(const RawFrame& small, double megapixels) {
  const int width = 2 * static_cast<int>(std::lround(std::sqrt(1.5e6 * megapixels) / 2));
  return tiled(small, width, 2 * static_cast<int>(std::lround(width / 3.0)));
}

/// One line of the table; values that were not measured are not numbers.
struct ScalingRow {
  std::string plan;
  double megapixels = nan;
  int threads = 1;
  double jobs = nan;
  double ms_per_mp = nan;
  double spread = nan;
  double times_memcpy = nan;
  double peak_bytes_per_pixel = nan;
  double ms_per_file = nan;
};

double pixels_of(const RawFrame& frame) { return 1.0 * frame.raw.active.width * frame.raw.active.height; }

std::vector<int> thread_counts(int threads) {
  std::vector<int> out{1};
  if (threads >= 2) out.push_back(2);
  if (threads > 2) out.push_back(threads);
  return out;
}

/// Times all plans with all numbers of threads, in turn, on one frame.
std::vector<ScalingRow> rows_of(const RawFrame& frame, const std::vector<std::unique_ptr<Executor>>& executors,
                                int rounds) {
  const double megapixels = 1e-6 * pixels_of(frame);
  AccuracyGroup group{"", "", {}};
  std::vector<ScalingRow> out;
  for (const PlanKind& plan : plan_kinds) {
    const DevelopOptions options = options_of(plan);
    const auto peak = peak_bytes_of([&] {
      InlineExecutor one;
      return develop(frame, options, one).has_value();
    });
    for (const auto& executor : executors) {
      out.push_back({.plan = plan.name, .megapixels = megapixels, .threads = executor->width()});
      if (executor->width() == 1 && peak) out.back().peak_bytes_per_pixel = *peak / pixels_of(frame);
      group.levels.push_back({.name = plan.name,
                              .run = [&frame, &executor, options] { (void)develop(frame, options, *executor); },
                              .megapixels = megapixels});
    }
  }
  const auto measured = measure(group, {.rounds = rounds, .wall_clock = true});
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].ms_per_mp = measured[i].ms_per_mp;
    out[i].spread = measured[i].spread;
    out[i].times_memcpy = measured[i].times_memcpy;
  }
  return out;
}

std::string file_in(const PrivateFolder& folder, int index, const char* end) {
  return (folder.path() / (std::to_string(index) + end)).string();
}

Result<void> develop_file(const PrivateFolder& folder, int index, Executor& executor) {
  const auto frame = capture::read_raw(file_in(folder, index, ".dng"));
  if (!frame) return tl::make_unexpected(frame.error());
  const auto developed = develop(*frame, options_of(plan_kinds.back()), executor);
  if (!developed) return tl::make_unexpected(developed.error());
  return write_picture(developed->picture, OutputSpace::srgb, frame->raw.info, file_in(folder, index, ".png"),
                       {.overwrite = Overwrite::yes}, executor);
}

/// Develops all files, several at a time, each with an equal part of the threads.
Result<void> develop_files(const PrivateFolder& folder, int jobs, int threads) {
  std::atomic<int> next{0};
  std::vector<Result<void>> outcome(files);
  const auto work = [&] {
    PoolExecutor executor(std::max(1, threads / jobs));
    for (int i = next++; i < files; i = next++) {
      outcome[static_cast<std::size_t>(i)] = develop_file(folder, i, executor);
    }
  };
  std::vector<std::thread> others;
  others.reserve(static_cast<std::size_t>(jobs));
  for (int i = 1; i < jobs; ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  for (const Result<void>& each : outcome) {
    if (!each) return each;
  }
  return {};
}

Result<std::vector<ScalingRow>> rows_of_files(const RawFrame& frame, int threads, int rounds) {
  const Result<PrivateFolder> folder = PrivateFolder::make();
  if (!folder) return tl::make_unexpected(folder.error());
  for (int i = 0; i < files; ++i) {
    if (const auto written = write_dng(frame, file_in(*folder, i, ".dng")); !written) {
      return tl::make_unexpected(written.error());
    }
  }
  AccuracyGroup group{"", "", {}};
  std::vector<ScalingRow> out;
  Result<void> outcome;
  for (const int jobs : {1, 2}) {
    out.push_back({.plan = fmt::format("{} files, standard", files),
                   .megapixels = 1e-6 * pixels_of(frame),
                   .threads = threads,
                   .jobs = 1.0 * jobs});
    group.levels.push_back({.name = "",
                            .run =
                                [&folder, &outcome, jobs, threads] {
                                  if (auto done = develop_files(*folder, jobs, threads); !done) outcome = done;
                                },
                            .megapixels = files * 1e-6 * pixels_of(frame)});
  }
  const auto measured = measure(group, {.rounds = rounds, .wall_clock = true});
  if (!outcome) return tl::make_unexpected(outcome.error());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].ms_per_mp = measured[i].ms_per_mp;
    out[i].spread = measured[i].spread;
    out[i].times_memcpy = measured[i].times_memcpy;
    out[i].ms_per_file = measured[i].ms_per_mp * out[i].megapixels;
  }
  return out;
}

BenchTable table_of(const std::vector<ScalingRow>& rows) {
  BenchTable out{{"plan", "frame [MP]", "threads", "jobs", "time [ms/MP]", "spread [%]", "x memcpy",
                  "peak memory [bytes/pixel]", "time [ms/file]"},
                 {}};
  out.rows.reserve(rows.size());
  for (const ScalingRow& row : rows) {
    out.rows.push_back({row.plan, row.megapixels, 1.0 * row.threads, row.jobs, row.ms_per_mp, 100 * row.spread,
                        row.times_memcpy, row.peak_bytes_per_pixel, row.ms_per_file});
  }
  return out;
}

/// Plots a quantity over the frame's size, a line for each plan and number of threads that have it.
Plot plot_over_size(const std::vector<ScalingRow>& rows, std::string id, const std::string& label,
                    double ScalingRow::*figure) {
  Plot out{.id = std::move(id),
           .title = label + " over the size of the frame",
           .x_label = "frame [MP]",
           .y_label = label,
           .x_scale = AxisScale::logarithmic,
           .y_scale = AxisScale::logarithmic};
  for (const ScalingRow& row : rows) {
    if (!std::isfinite(row.*figure) || std::isfinite(row.jobs)) continue;
    const std::string name = fmt::format("{}, {} thread{}", row.plan, row.threads, row.threads == 1 ? "" : "s");
    auto series = std::ranges::find(out.series, name, &Series::name);
    if (series == out.series.end()) series = out.series.insert(out.series.end(), Series{name, {}, {}, Mark::line});
    series->x.push_back(row.megapixels);
    series->y.push_back(row.*figure);
  }
  return out;
}

/// Measures frames of all sizes that fit in memory.
std::vector<ScalingRow> rows_over_size(const RawFrame& small, const BenchOptions& options, const Rounds& rounds,
                                       std::string& left_out) {
  std::vector<std::unique_ptr<Executor>> executors;
  for (const int threads : thread_counts(options.threads)) executors.push_back(std::make_unique<PoolExecutor>(threads));
  std::vector<ScalingRow> out;
  double max_bytes_per_pixel = 0;
  const auto sizes = std::span(sizes_mp).first(options.quick ? quick_sizes : sizes_mp.size());
  for (const double megapixels : sizes) {
    options.advance(1 / static_cast<double>(sizes.size() + 1), fmt::format("frames of {:g} MP", megapixels));
    if (1e6 * megapixels * max_bytes_per_pixel > memory_fraction * physical_bytes()) {
      left_out += fmt::format("; {:g} MP not measured, because memory is too small", megapixels);
      continue;
    }
    const int of_size = megapixels < rounds.few_from_mp ? rounds.usual : rounds.few;
    for (ScalingRow& row : rows_of(frame_of(small, megapixels), executors, of_size)) {
      max_bytes_per_pixel = std::fmax(max_bytes_per_pixel, row.peak_bytes_per_pixel);
      out.push_back(std::move(row));
    }
  }
  return out;
}

}  // namespace

std::optional<double> peak_bytes_of(const std::function<bool()>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return std::nullopt;
  const pid_t child = fork();
  if (child == 0) send_result(ends[1], work);
  close(ends[1]);
  double added = -1;
  const bool heard = child > 0 && read(ends[0], &added, sizeof added) == static_cast<ssize_t>(sizeof added);
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  if (!heard || added < 0) return std::nullopt;
  return added;
}

Result<BenchOutcome> run_scaling_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto picture =
      read_bench_pictures(options.pictures_folder, files_of(options.pictures).first(1), {768, 512}, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  const auto raws = simulated_raws(picture->front(), develop_lights(true).front(), 1, executor);
  if (!raws) return tl::make_unexpected(raws.error());
  const Rounds rounds = options.quick ? quick_rounds : full_rounds;
  std::string left_out;
  std::vector<ScalingRow> rows = rows_over_size(raws->noisy, options, rounds, left_out);
  const RawFrame of_file = frame_of(raws->noisy, options.quick ? sizes_mp[0] : file_mp);
  auto of_files = rows_of_files(of_file, options.threads, options.quick ? 2 : 3);
  if (!of_files) return tl::make_unexpected(of_files.error());
  rows.insert(rows.end(), of_files->begin(), of_files->end());
  BenchOutcome out{.table = table_of(rows)};
  out.plots = {plot_over_size(rows, "scaling-time", "time [ms/MP]", &ScalingRow::ms_per_mp),
               plot_over_size(rows, "scaling-memory", "peak memory [bytes/pixel]", &ScalingRow::peak_bytes_per_pixel)};
  out.remarks.push_back(timing_remark({.rounds = rounds.usual, .wall_clock = true}, options.threads) +
                        fmt::format("; from {:g} MP on {}; the number of threads is in its column{}",
                                    rounds.few_from_mp, rounds.few, left_out));
  out.remarks.emplace_back(
      "frames repeat one frame of 20 e- and are planned and developed each time; peak memory is the increase of the "
      "largest resident set of a child process with one thread, without the 2 bytes per pixel of the frame");
  out.remarks.push_back(
      fmt::format("{} files: DNGs are read, developed and written as PNG by this number of jobs in parallel, which "
                  "share the threads",
                  files));
  options.advance(1.0 / (options.quick ? quick_sizes + 1 : sizes_mp.size() + 1), "several files");
  return out;
}

}  // namespace lowlux::isp
