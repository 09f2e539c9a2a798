#include <algorithm>
#include <cstdio>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "denoise/denoiser.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_report.h"
#include "isp/cli/bench/bench_work.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/pipeline/budget/frame_sample.h"

namespace lowlux::cli {
namespace {

Result<std::vector<isp::BenchStage>> stages_of(const std::vector<std::string>& ids) {
  if (ids.empty()) return std::vector<isp::BenchStage>(isp::bench_stages().begin(), isp::bench_stages().end());
  std::vector<isp::BenchStage> out;
  out.reserve(ids.size());
  for (const std::string& id : ids) {
    const auto stage = isp::bench_stage_named(id);
    if (!stage) return tl::make_unexpected(stage.error());
    const bool again = std::ranges::any_of(out, [&](const isp::BenchStage& other) { return other.id == stage->id; });
    if (!again) out.push_back(*stage);
  }
  return out;
}

/// Holds the stages to run, and which lights of the stage `methods`.
struct ChosenStages {
  std::vector<isp::BenchStage> stages;
  Shard lights;
};

/// Returns the stages that are asked for, or a shard of them; `methods` alone is divided by its lights instead.
Result<ChosenStages> chosen(const BenchArgs& args) {
  const bool methods_alone = args.stages.empty() && !args.methods.empty();
  auto stages = stages_of(methods_alone ? std::vector<std::string>{"methods"} : args.stages);
  if (!stages) return tl::make_unexpected(stages.error());
  if (stages->size() == 1 && stages->front().id == "methods") return ChosenStages{*std::move(stages), args.shard};
  if (args.shard.number > stages->size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("shard {} of {} is empty: {} stages are requested", args.shard.number, args.shard.count,
                            stages->size()),
                "--shard");
  }
  args.shard.select(*stages);
  return ChosenStages{*std::move(stages), {}};
}

/// Prints what failed within a stage, one line each.
void print_failures(const std::vector<Error>& failures, Progress& progress) {
  for (const Error& error : failures) {
    progress.print([&] { print_err(fmt::format("{}\n", error_line(error.where, error))); });
  }
}

/// Runs every stage; a failed stage is reported at once, and the others continue.
std::vector<MeasuredStage> run_each(const std::vector<isp::BenchStage>& stages, const isp::BenchOptions& options,
                                    const std::string& call) {
  std::vector<MeasuredStage> out;
  Progress progress(static_cast<int>(stages.size()), true);
  for (const isp::BenchStage& stage : stages) {
    isp::BenchOptions with = options;
    with.advance = [&progress](double share, const std::string& what) { progress.advance(share, what); };
    auto done = measure_stage(stage, with, call);
    if (done) {
      print_failures(done->outcome.failures, progress);
      out.push_back(*std::move(done));
    } else {
      const Error& error = done.error();
      const std::string where = error.where.empty() ? std::string(stage.id) : error.where;
      progress.print([&] { print_err(fmt::format("{}\n", error_line(where, error))); });
    }
  }
  return out;
}

/// Returns own levels and the methods asked for; those that are not installed are reported.
Result<std::vector<isp::ScoredMethod>> all_methods(const BenchArgs& args) {
  auto requested = requested_methods(args.methods);
  if (!requested) return tl::make_unexpected(requested.error());
  auto methods = own_methods();
  if (!methods) return methods;
  for (isp::ScoredMethod& method : requested->methods) methods->push_back(std::move(method));
  if (const auto good = check_method_names(*methods); !good) return tl::make_unexpected(good.error());
  for (const Error& error : requested->not_installed) print_err(fmt::format("{}\n", error_line(error.where, error)));
  return methods;
}

/// Returns the command line that repeats a run.
std::string command_line(const std::vector<std::string>& words) {
  std::string out = "lowlux bench";
  for (const std::string& word : words) out += ' ' + isp::shell_word(word);
  return out;
}

/// Adds the methods and OpenCV's module, or why it is missing.
void add_methods(std::vector<isp::ScoredMethod> methods, isp::BenchOptions& options) {
  options.methods = std::move(methods);
  if (const auto nl_means = load_nl_means()) {
    options.nl_means = *nl_means;
  } else {
    options.why_no_nl_means = nl_means.error().message;
  }
}

/// Prints the times of each part for a frame of 12 MP.
int run_calibrate_cost(const BenchArgs& args) {
  const int threads = args.threads > 0 ? args.threads : threads_of_each(1);
  std::string file;
  const auto model = calibrate_cost(threads, args.json, file);
  if (!model) return print_failure(model.error(), object_if(args.json));
  if (args.json) {
    print_out(fmt::format("{}", cost_text(*model)));
    return exit_done;
  }
  print_out(fmt::format("{}, {} threads; ms for a frame of 12 MP\n", model->machine, threads));
  for (int i = 0; i < isp::cost_parts; ++i) {
    const auto part = static_cast<isp::CostPart>(i);
    const bool sampled = part == isp::CostPart::samples;  // it takes equally long for any size of frame
    const isp::CostSize size = sampled ? isp::CostSize{isp::sample_megapixels} : isp::cost_size(4000, 3000);
    print_out(fmt::format("  {:<12}{:10.1f}\n", name_of(part), 1e3 * model->seconds(part, size)));
  }
  print_out(fmt::format("{}\n", file.empty() ? "not kept" : "kept in " + file));
  return exit_done;
}

int list_stages(bool json) {
  if (json) {
    auto stages = nlohmann::ordered_json::array();
    for (const isp::BenchStage& stage : isp::bench_stages())
      stages.push_back({{"id", stage.id}, {"title", stage.title}});
    print_out(nlohmann::ordered_json{{"stages", stages}}.dump(2) + "\n");
    return exit_done;
  }
  for (const isp::BenchStage& stage : isp::bench_stages()) print_out(fmt::format("{:<20} {}\n", stage.id, stage.title));
  return exit_done;
}

}  // namespace

int run_bench(const std::vector<std::string>& words) {
  const Parsed<BenchArgs> parsed = parse_bench(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<BenchArgs>(parsed);
  if (args.list) return list_stages(args.json);
  if (args.calibrate_cost) return run_calibrate_cost(args);
  const auto to_run = chosen(args);
  if (!to_run) return print_usage_error("bench", to_run.error(), object_if(args.json));
  const std::vector<isp::BenchStage>& stages = to_run->stages;
  auto methods = all_methods(args);
  if (!methods) return print_usage_error("bench", methods.error(), object_if(args.json));
  auto options = bench_options(args);
  if (!options) return print_failure(options.error(), object_if(args.json));
  options->shard = to_run->lights;
  if (const auto free = check_bench_files(stages, args); !free) {
    return print_failure(free.error(), object_if(args.json));
  }
  const std::size_t not_installed = args.methods.size() + denoise::all_levels.size() - methods->size();
  add_methods(*std::move(methods), *options);
  const std::vector<MeasuredStage> measured = run_each(stages, *options, command_line(words));
  const bool all_done =
      measured.size() == stages.size() && not_installed == 0 &&
      std::ranges::all_of(measured, [](const MeasuredStage& m) { return m.outcome.failures.empty(); });
  const Machine machine = this_machine(options->threads);
  if (args.json) {
    print_out(fmt::format("{}\n", bench_json(measured, machine)));
  } else {
    for (const MeasuredStage& stage : measured) print_out(fmt::format("{}", bench_text(stage)));
  }
  if (!args.output.empty() && !measured.empty()) {
    PoolExecutor executor(options->threads);
    const auto written = write_bench_files(measured, machine, args, executor);
    if (!written) return print_failure(written.error());
    if (!args.json) print_out("\nwritten:\n");
    for (const std::string& name : *written) {
      if (!args.json) print_out(fmt::format("  {}\n", one_line(name)));
    }
  }
  if (!args.json && !measured.empty()) print_out(fmt::format("\n{}\n", time_text(measured)));
  return all_done ? exit_done : exit_failed;
}

}  // namespace lowlux::cli
