#include <optional>

#include <pybind11/stl.h>

#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/develop_work.h"
#include "isp/cli/merge/merge_files.h"
#include "isp/cli/merge/merge_report.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/report.h"
#include "isp/output/picture/image_writer.h"
#include "isp/python/call.h"
#include "isp/python/module.h"
#include "isp/python/text.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

using Words = std::vector<std::string>;
using Names = std::vector<std::pair<std::string, RawImagePtr>>;

std::vector<Input> inputs_of(const Names& names) {
  std::vector<Input> out;
  for (const auto& [name, frame] : names) out.push_back({name, frame});
  return out;
}

/// Returns the calibration files, after a check that the output replaces none of the files that are read.
cli::CalibrationFiles checked_files(const cli::DevelopArgs& args, const std::vector<cli::Job>& jobs) {
  std::vector<std::string> inputs;
  for (const cli::Job& job : jobs) inputs.push_back(job.input);
  value_of(cli::check_unharmed(jobs, inputs));
  return value_of(cli::calibration_files(args, jobs));
}

/// Returns a job for each input, all with the output of the arguments.
std::vector<cli::Job> jobs_of(const std::vector<Input>& inputs, const cli::DevelopArgs& args) {
  const isp::Overwrite overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  std::vector<cli::Job> jobs;
  for (const Input& input : inputs) jobs.push_back({input.name, args.output, overwrite});
  return jobs;
}

/// Returns a result, whose error refers to the input if it has no place.
template <class T>
T value_at(Result<T>&& result, const std::string& input) {
  if (!result) throw Failure(cli::with_file(std::move(result.error()), input));
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// Returns maps by the ending of their names: noise, confidence, seeing.
py::dict dict_of(std::vector<cli::PixelMap> maps) {
  py::dict out;
  for (cli::PixelMap& map : maps) {
    const std::string stem = map.path.substr(0, map.path.rfind('.'));
    out[py::str(stem.substr(stem.rfind('.') + 1))] = array_of(std::move(map.value));
  }
  return out;
}

/// Returns the format of the output; without one, a format that holds the requested samples.
isp::FileFormat format_of(const cli::DevelopArgs& args) {
  if (!args.output.empty()) return value_of(isp::format_of(args.output));
  return args.bits.value_or(8) == 32 ? isp::FileFormat::exr : isp::FileFormat::png;
}

std::vector<std::string> names_of(const std::vector<Input>& inputs) {
  std::vector<std::string> out;
  for (const Input& input : inputs) out.push_back(input.name);
  return out;
}

/// Returns the inputs as a batch of jobs, with the calibration files of the arguments.
cli::RawBatch batch_of(const std::vector<Input>& inputs, const cli::DevelopArgs& args, isp::DevelopOptions options) {
  std::vector<cli::Job> jobs = jobs_of(inputs, args);
  const cli::CalibrationFiles files = checked_files(args, jobs);
  cli::RawBatch batch = value_of(cli::make_batch(args, std::move(options), std::move(jobs), files));
  batch.read = reader_of(inputs);
  return batch;
}

struct DevelopResult {
  cli::DevelopedFrame frame;
  std::string plan;
};

DevelopResult developed(const std::vector<Input>& inputs, const std::string& output, bool overwrite,
                        const Words& words) {
  auto args = parsed(
      +[](const std::vector<std::string>& arguments) { return cli::parse_develop(arguments, cli::options_contradict); },
      words);
  set_call(output, overwrite, args);
  std::optional<std::vector<std::string>> frames;
  if (args.merge) {
    check_frames_in_memory(inputs);
    frames = names_of(inputs);
  }
  args.merging.options.developed_after = args.merge;
  isp::DevelopOptions options = value_of(cli::complete_options(args, format_of(args)));
  const cli::RawBatch batch = batch_of(inputs, args, std::move(options));
  const cli::Job& job = batch.jobs.front();
  PoolExecutor executor(cli::threads_of_each(1));
  cli::Progress none(1, false);
  cli::FileProgress progress(none, job.input);
  cli::DevelopOutcome out{job.input, job.output};
  out.flat = batch.flat;
  auto made = value_at(cli::develop_frame(batch, job, frames, executor, progress, out), job.input);
  if (!output.empty()) value_at(cli::write_developed(batch, job, made, executor, out), job.input);
  return {std::move(made), cli::develop_json(out, args.defaults)};
}

py::tuple develop(const Names& names, const std::string& output, bool overwrite, const Words& words) {
  std::optional<DevelopResult> made;
  {
    const py::gil_scoped_release released;
    made = developed(inputs_of(names), output, overwrite, words);
  }
  return py::make_tuple(array_of(std::move(made->frame.picture)), made->plan, dict_of(std::move(made->frame.maps)));
}

struct DenoiseResult {
  cli::DenoisedFrame frame;
  std::string plan;
};

DenoiseResult denoised(const std::vector<Input>& inputs, const std::string& output, bool overwrite,
                       const Words& words) {
  auto args = parsed(cli::parse_denoise, words);
  set_call(output, overwrite, args);
  const cli::RawBatch batch = batch_of(inputs, args, cli::without_rendering(args.options));
  const cli::Job& job = batch.jobs.front();
  PoolExecutor executor(cli::threads_of_each(1));
  cli::Progress none(1, false);
  cli::FileProgress progress(none, job.input);
  cli::DevelopOutcome out{job.input, job.output};
  auto made = value_at(cli::denoise_frame(batch, job, executor, progress, out), job.input);
  if (!output.empty()) value_at(cli::write_denoised(batch, job, made, out), job.input);
  return {std::move(made), cli::develop_json(out, args.defaults)};
}

py::tuple denoise(const Names& names, const std::string& output, bool overwrite, const Words& words) {
  std::optional<DenoiseResult> made;
  {
    const py::gil_scoped_release released;
    made = denoised(inputs_of(names), output, overwrite, words);
  }
  auto raw = std::make_shared<RawImage>();
  raw->frame = std::move(made->frame.frame);
  return py::make_tuple(raw, made->plan, dict_of(std::move(made->frame.maps)));
}

struct MergeResult {
  isp::MergedRaw merged;
  std::string plan;
};

MergeResult merged(const std::vector<Input>& inputs, const std::string& output, bool overwrite, const Words& words) {
  auto args = parsed(cli::parse_merge, words);
  set_call(output, overwrite, args);
  check_frames_in_memory(inputs);
  const std::vector<cli::Job> jobs = jobs_of(inputs, args);
  const cli::CalibrationFiles files = checked_files(args, jobs);
  const std::vector<std::string> names = names_of(inputs);
  cli::RawBatch batch = value_of(cli::make_batch(args, args.options, {{{}, output, jobs.front().overwrite}}, files));
  batch.read = reader_of(inputs);
  PoolExecutor executor(cli::threads_of_each(1));
  cli::Progress none(1, false);
  cli::FileProgress progress(none, output);
  const cli::Job& job = batch.jobs.front();
  cli::MergeReport report = value_of(cli::merge_files(batch, names, job, executor, progress));
  if (!output.empty()) value_of(cli::write_merged(batch, job, report));
  std::string plan = cli::merge_json(report);
  return {std::move(report.merged), std::move(plan)};
}

py::tuple merge(const Names& names, const std::string& output, bool overwrite, const Words& words) {
  std::optional<MergeResult> made;
  {
    const py::gil_scoped_release released;
    made = merged(inputs_of(names), output, overwrite, words);
  }
  auto raw = std::make_shared<RawImage>();
  raw->frame = std::move(made->merged.frame);
  return py::make_tuple(raw, made->plan, strs_of(made->merged.warnings));
}

}  // namespace

void add_develop(py::module_& module) {
  module.def("merge", merge);
  module.def("develop", develop);
  module.def("denoise", denoise);
}

}  // namespace lowlux::python
