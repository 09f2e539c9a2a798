#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/cli/bench/bench_report.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/output/report/report.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::cli {
namespace {

struct Done {
  isp::Experiment experiment;
  isp::Outcome outcome;
};

struct TextFile {
  std::string name;
  std::string text;
};

Result<std::vector<isp::Experiment>> chosen_experiments(const std::vector<std::string>& ids) {
  if (ids.empty()) return std::vector<isp::Experiment>(isp::experiments().begin(), isp::experiments().end());
  std::vector<isp::Experiment> out;
  for (const std::string& id : ids) {
    const auto experiment = isp::experiment_named(id);
    if (!experiment) return tl::make_unexpected(experiment.error());
    out.push_back(*experiment);
  }
  return out;
}

isp::RunOptions options_of(const ReproduceArgs& args) {
  isp::RunOptions options{.seed = args.seed, .quick = args.quick};
  options.pictures_folder = pictures_folder(args.pictures_folder);
  return options;
}

// Runs every experiment; a failed experiment is reported at once, and the others continue.
std::vector<Done> run_experiments(const std::vector<isp::Experiment>& experiments, const ReproduceArgs& args) {
  std::vector<Done> out;
  Progress progress(static_cast<int>(experiments.size()), true);
  const isp::RunOptions options = options_of(args);
  for (const isp::Experiment& experiment : experiments) {
    const std::string id(experiment.id);
    progress.advance(0, id);
    auto outcome = experiment.run(options);
    if (outcome) {
      out.push_back({experiment, *std::move(outcome)});
    } else {
      progress.print([&] {
        const Error& error = outcome.error();
        print_err(fmt::format("{}\n", error_line(error.where.empty() ? id : error.where, error)));
      });
    }
    progress.advance(1, id);
  }
  return out;
}

std::vector<isp::Finding> findings_of(const std::vector<Done>& done) {
  std::vector<isp::Finding> out;
  for (const Done& d : done) out.insert(out.end(), d.outcome.findings.begin(), d.outcome.findings.end());
  return out;
}

std::vector<TextFile> files_of(const std::vector<Done>& done, const ReproduceArgs& args) {
  const std::vector<isp::Finding> findings = findings_of(done);
  std::vector<TextFile> out{{"findings.csv", isp::csv_of(isp::table_of(findings))}};
  isp::Report report{
      "lowlux reproduce: published findings and results of lowlux",
      fmt::format("Seed {}{}. Each published finding is listed next to the same quantity computed by lowlux, each "
                  "additional check next to the expected value. Verdicts: {}; if only the order or the sign of a claim "
                  "agrees, the verdict is 'same direction'. Published findings: {}. Additional checks: {}.",
                  args.seed, args.quick ? ", quick: fewer samples" : "", isp::tolerance_of_verdicts,
                  isp::count_of_verdicts(findings, isp::Finding::Kind::published),
                  isp::count_of_verdicts(findings, isp::Finding::Kind::check)),
      {}};
  for (const Done& d : done) {
    report.sections.push_back(
        {std::string(d.experiment.title), {}, isp::table_of(d.outcome.findings), d.outcome.plots});
    for (const isp::Plot& plot : d.outcome.plots) out.push_back({plot.id + ".csv", isp::csv_of(plot)});
  }
  isp::Table left_out{{"not reproduced", "reason"}, {}};
  for (const isp::NotReproduced& part : isp::not_reproduced()) {
    left_out.rows.push_back({std::string(part.what), std::string(part.why)});
  }
  report.sections.push_back({"Not reproduced", {}, std::move(left_out), {}});
  out.push_back({"report.html", isp::html_of(report)});
  return out;
}

// Checks before the work the two files that are always written. write_text checks each again.
std::optional<Error> in_the_way(const ReproduceArgs& args) {
  if (args.output.empty() || args.force) return std::nullopt;
  for (const char* name : {"findings.csv", "report.html"}) {
    const std::string path = (std::filesystem::path(args.output) / name).string();
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored)) {
      return Error{ErrorCode::exists, "the file exists: use --force to overwrite it", path};
    }
  }
  return std::nullopt;
}

// Writes all files; nothing if one of them exists.
Result<void> write_all(const std::vector<TextFile>& files, const ReproduceArgs& args) {
  std::error_code error;
  const std::filesystem::path folder(args.output);
  std::filesystem::create_directories(folder, error);
  if (error) return fail(ErrorCode::unwritable, "the folder cannot be created: " + error.message(), args.output);
  for (const TextFile& file : files) {
    std::error_code ignored;
    if (!args.force && std::filesystem::exists(folder / file.name, ignored)) {
      return fail(ErrorCode::exists, "the file exists: use --force to overwrite it", (folder / file.name).string());
    }
  }
  const auto overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  for (const TextFile& file : files) {
    if (auto written = isp::write_text((folder / file.name).string(), file.text, overwrite); !written) {
      return written;
    }
  }
  return {};
}

int list_experiments(bool json) {
  if (json) {
    auto experiments = nlohmann::ordered_json::array();
    for (const isp::Experiment& e : isp::experiments()) experiments.push_back({{"id", e.id}, {"title", e.title}});
    print_out(nlohmann::ordered_json{{"experiments", experiments}}.dump(2) + "\n");
    return exit_done;
  }
  for (const isp::Experiment& e : isp::experiments()) print_out(fmt::format("{:<22} {}\n", e.id, e.title));
  return exit_done;
}

}  // namespace

int run_reproduce(const std::vector<std::string>& words) {
  const Parsed<ReproduceArgs> parsed = parse_reproduce(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<ReproduceArgs>(parsed);
  if (args.list) return list_experiments(args.json);
  const auto experiments = chosen_experiments(args.experiments);
  if (!experiments) return print_usage_error("reproduce", experiments.error(), object_if(args.json));
  if (const auto error = in_the_way(args)) return print_failure(*error, object_if(args.json));
  const std::vector<Done> done = run_experiments(*experiments, args);
  if (!args.output.empty()) {
    const auto written = write_all(files_of(done, args), args);
    if (!written) return print_failure(written.error(), object_if(args.json));
  }
  const std::vector<isp::Finding> findings = findings_of(done);
  print_out(args.json ? findings_json(findings) + '\n' : findings_text(findings));
  if (!args.json && args.experiments.empty()) print_out(not_reproduced_text());
  return done.size() == experiments->size() ? exit_done : exit_failed;
}

}  // namespace lowlux::cli
