#include "isp/cli/develop/cost_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/file_bytes.h"
#include "isp/base/executor.h"
#include "isp/base/json_text.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/cost/cost_measurement.h"
#include "isp/cost/speed_probe.h"
#include "isp/output/report/report.h"
#include "isp/pipeline/budget/cost_model.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr int format_number = 7;  // incremented when parts, sizes or frames change
constexpr std::size_t largest_file = 1 << 20;
constexpr std::size_t max_points = 100;

tl::unexpected<Error> malformed(const std::string& what) {
  return fail(ErrorCode::malformed, "no cost model: " + what + "; bench --calibrate-cost makes one");
}

/// Returns the points of one part after checks: rising sizes, possible times.
std::optional<std::vector<isp::CostPoint>> points_of(const Json& json) {
  if (!json.is_array() || json.size() > max_points) return std::nullopt;
  std::vector<isp::CostPoint> out;
  for (const Json& pair : json) {
    if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number() || !pair[1].is_number()) return std::nullopt;
    const isp::CostPoint point{pair[0].get<double>(), pair[1].get<double>()};
    const double before = out.empty() ? 0 : out.back().megapixels;
    if (!(point.megapixels > before) || !(point.seconds >= 0) || !std::isfinite(point.megapixels + point.seconds)) {
      return std::nullopt;
    }
    out.push_back(point);
  }
  return out;
}

Result<void> write_cost(const std::string& path, const isp::CostModel& model) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  if (error) return fail(ErrorCode::unwritable, "the folder cannot be created: " + error.message(), path);
  return isp::write_text(path, cost_text(model), isp::Overwrite::yes);
}

}  // namespace

int threads_of_each(int files) {
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / files, 1, 8);
}

std::string machine_name() {
  const Machine machine = this_machine(1);
  return fmt::format("{}, {} processors, {}, lowlux {}", machine.cpu.value_or("unknown processor"), machine.processors,
                     machine.kernels, machine.lowlux);
}

std::optional<std::string> cost_file(int threads) {
  // NOLINTBEGIN(concurrency-mt-unsafe): nothing here sets variables
  const char* const cache = std::getenv("XDG_CACHE_HOME");
  const char* const home = std::getenv("HOME");
  // NOLINTEND(concurrency-mt-unsafe)
  std::filesystem::path folder;
  if (cache != nullptr && *cache == '/') {
    folder = cache;
  } else if (home != nullptr && *home != '\0') {
    folder = std::filesystem::path(home) / ".cache";
  } else {
    return std::nullopt;
  }
  return (folder / "lowlux" / fmt::format("cost-{}.json", threads)).string();
}

std::string cost_text(const isp::CostModel& model) {
  Json json{{"lowlux_cost_model", format_number},
            {"machine", model.machine},
            {"threads", model.threads},
            {"pace_s", model.pace_s},
            {"megapixels_and_seconds", Json::object()}};
  for (int i = 0; i < isp::cost_parts; ++i) {
    Json points = Json::array();
    for (const isp::CostPoint& point : model.points[static_cast<std::size_t>(i)]) {
      points.push_back({point.megapixels, point.seconds});
    }
    json["megapixels_and_seconds"][std::string(name_of(static_cast<isp::CostPart>(i)))] = std::move(points);
  }
  return json_text(json, 1) + "\n";
}

Result<isp::CostModel> parse_cost(std::string_view text) {
  if (nests_deeper(text, max_json_depth)) return malformed("it is nested too deeply");
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json.value("lowlux_cost_model", Json()) != Json(format_number)) {
    return malformed(fmt::format("it does not contain \"lowlux_cost_model\": {}", format_number));
  }
  const Json machine = json.value("machine", Json()), threads = json.value("threads", Json());
  const Json parts = json.value("megapixels_and_seconds", Json()), pace = json.value("pace_s", Json());
  if (!machine.is_string() || !threads.is_number_integer() || !pace.is_number() || !parts.is_object()) {
    return malformed("machine, threads, pace_s or megapixels_and_seconds is missing");
  }
  isp::CostModel model;
  model.machine = machine.get<std::string>();
  const auto count = threads.get<std::int64_t>();
  if (count < 1 || count > std::numeric_limits<int>::max())
    return malformed("threads is not a valid number of threads");
  model.threads = static_cast<int>(count);
  model.pace_s = pace.get<double>();
  if (!(model.pace_s >= 0) || !std::isfinite(model.pace_s)) return malformed("pace_s is not a time");
  for (int i = 0; i < isp::cost_parts; ++i) {
    const std::string name(name_of(static_cast<isp::CostPart>(i)));
    auto points = points_of(parts.value(name, Json()));
    if (!points || points->empty()) return malformed(name + " has no times sorted by size");
    model.points[static_cast<std::size_t>(i)] = *std::move(points);
  }
  return model;
}

Result<isp::CostModel> kept_cost(int threads) {
  const auto path = cost_file(threads);
  if (!path) return fail(ErrorCode::not_found, "it is not stored, because neither XDG_CACHE_HOME nor HOME is set");
  std::error_code ignored;
  if (!std::filesystem::exists(*path, ignored)) return fail(ErrorCode::not_found, "no measurement is stored", *path);
  const auto bytes = capture::read_file_bytes(*path, largest_file);
  if (!bytes) return tl::make_unexpected(bytes.error());
  auto model = parse_cost(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  if (!model) return model;
  if (const std::string machine = machine_name(); model->machine != machine) {
    return fail(
        ErrorCode::unsupported,
        fmt::format("the stored measurement is of another machine: {}, and this is {}", model->machine, machine),
        *path);
  }
  if (model->threads != threads) {
    return fail(ErrorCode::unsupported,
                fmt::format("the stored measurement is for {} threads, not {}", model->threads, threads), *path);
  }
  return model;
}

Result<isp::CostModel> calibrate_cost(int threads, bool quiet, std::string& written_to) {
  PoolExecutor executor(threads);
  Progress progress(1, !quiet);
  auto model = isp::measure_cost(executor, [&](double share, const std::string& what) {
    progress.advance(share, "this machine's speed: " + what);
  });
  if (!model) return model;
  model->machine = machine_name();
  const auto path = cost_file(threads);
  if (!path) return model;
  if (const auto written = write_cost(*path, *model); !written) {
    progress.print([&] {
      print_err(fmt::format(
          "{}\n",
          one_line(fmt::format(
              "lowlux: warning: {}: the speed of this machine is not stored, so times remain rough estimates: {}",
              *path, written.error().message))));
    });
  } else {
    written_to = *path;
  }
  return model;
}

isp::CostModel cost_of_this_machine(int threads, bool quiet) {
  auto kept = kept_cost(threads);
  if (kept) return *std::move(kept);
  if (!quiet) {
    print_err(fmt::format(
        "{}\n",
        one_line("lowlux: times are rough estimates until `lowlux bench --calibrate-cost` (3 to 8 minutes) measures "
                 "this machine: " +
                 kept.error().message)));
  }
  return isp::reference_cost();
}

Result<std::shared_ptr<const isp::CostModel>> MachineSpeed::now(Executor& executor) {
  auto model = std::make_shared<isp::CostModel>(calibrated_);
  if (!(calibrated_.pace_s > 0)) return model;
  const Result<double> seconds = isp::pace_now(pace_, executor);
  if (!seconds) return tl::make_unexpected(seconds.error());
  model->pace = *seconds / calibrated_.pace_s;
  return model;
}

}  // namespace lowlux::cli
