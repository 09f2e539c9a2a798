#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "isp/base/float_samples.h"
#include "isp/bench/bench_stages.h"
#include "isp/cli/bench/bench_args.h"
#include "isp/cli/bench/bench_report.h"
#include "isp/cli/bench/bench_work.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/python/call.h"
#include "isp/python/module.h"
#include "isp/python/picture_argument.h"
#include "isp/python/raw_image.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

/// A method as Python passes it: its name, --method's text ("" for a function), the function (None for a command).
using Entry = std::tuple<std::string, std::string, py::object>;

/// Returns what a function made, copied. Throws Failure for what is not an image, and for samples that no frame can
/// have.
isp::MethodImage image_of(const py::object& result, Executor& executor) {
  if (py::isinstance<RawImage>(result)) {
    RawFrame frame = clone(result.cast<RawImagePtr>()->frame);
    if (const auto wrong = unusable_sample(frame.raw)) {
      throw Failure({ErrorCode::malformed, "its result: " + *wrong, {}});
    }
    return frame;
  }
  if (!py::isinstance<py::array>(result)) {
    throw Failure({ErrorCode::malformed, "its result is neither a RawImage nor an array", {}});
  }
  return std::move(scene_of(picture_argument(result, "its result"), executor).xyz);
}

/// Returns str(object), with escapes for what UTF-8 cannot hold; nullopt if str() fails.
std::optional<std::string> escaped_text(const py::handle& object) {
  const auto text = py::reinterpret_steal<py::object>(PyObject_Str(object.ptr()));
  const auto bytes =
      text ? py::reinterpret_steal<py::object>(PyUnicode_AsEncodedString(text.ptr(), "utf-8", "backslashreplace"))
           : py::object();
  if (bytes) return bytes.cast<std::string>();
  PyErr_Clear();  // of an exception's own __str__
  return std::nullopt;
}

/// Returns the exception of a function in one line, without its traceback.
std::string line_of(const py::error_already_set& error) {
  std::string line = escaped_text(error.type().attr("__name__")).value_or("an exception");
  if (const auto text = escaped_text(error.value())) line += ": " + *text;
  return cli::one_line(line);
}

/// Calls a function with a copy of the frame. Whatever it does wrong is an Error; SystemExit, KeyboardInterrupt and
/// others that are no Exception of Python are passed on.
Result<isp::MethodImage> call(const py::handle& function, const RawFrame& noisy) {
  const py::gil_scoped_acquire held;
  InlineExecutor executor;
  try {
    return image_of(function(std::make_shared<RawImage>(RawImage{clone(noisy)})), executor);
  } catch (const Failure& failure) {
    return tl::make_unexpected(failure.error());
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_Exception)) throw;
    return fail(ErrorCode::malformed, "it raised " + line_of(error));
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::too_large, "not enough memory");
  } catch (const std::exception& failure) {
    return fail(ErrorCode::malformed, cli::one_line(failure.what()));
  }
}

/// Returns the methods; functions are borrowed from the entries.
cli::RequestedMethods methods_of(const std::vector<Entry>& entries) {
  cli::RequestedMethods out;
  for (const auto& [name, text, function] : entries) {
    if (!isp::is_method_name(name)) {
      throw Failure(
          {ErrorCode::invalid_argument, "'" + name + "' is not a name of letters, digits and ._-", "methods"});
    }
    if (text.empty()) {
      const py::handle borrowed = function;
      out.methods.push_back(
          {.name = name, .call = [borrowed](const RawFrame& noisy) { return call(borrowed, noisy); }});
      continue;
    }
    const py::gil_scoped_release released;  // a program is looked for, after the runs of other threads
    cli::RequestedMethods one = value_of(cli::requested_methods({text}));
    for (isp::ScoredMethod& method : one.methods) out.methods.push_back(std::move(method));
    for (Error& error : one.not_installed) out.not_installed.push_back(std::move(error));
  }
  value_of(cli::check_method_names(out.methods));
  return out;
}

std::string bench(const std::string& output, bool overwrite, const std::vector<std::string>& words,
                  const std::vector<Entry>& entries) {
  cli::BenchArgs args = parsed(cli::parse_bench, words);
  args.output = output;
  args.force = overwrite;
  cli::RequestedMethods requested = methods_of(entries);
  const py::gil_scoped_release released;
  const isp::BenchStage stage = value_of(isp::bench_stage_named("methods"));
  isp::BenchOptions options = value_of(cli::bench_options(args));
  options.shard = args.shard;
  value_of(cli::check_bench_files({stage}, args));
  options.methods = std::move(requested.methods);
  std::vector<cli::MeasuredStage> measured;
  measured.push_back(value_of(cli::measure_stage(stage, options, "lowlux.bench of Python")));
  std::vector<Error>& failures = measured.front().outcome.failures;
  failures.insert(failures.begin(), requested.not_installed.begin(), requested.not_installed.end());
  const cli::Machine machine = cli::this_machine(options.threads);
  if (!output.empty()) {
    PoolExecutor executor(options.threads);
    value_of(cli::write_bench_files(measured, machine, args, executor));
  }
  return cli::bench_json(measured, machine);
}

}  // namespace

void add_bench(py::module_& module) { module.def("bench", bench); }

}  // namespace lowlux::python
