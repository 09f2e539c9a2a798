#include "isp/cli/bench/bench_work.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "isp/cli/shared/module.h"

namespace lowlux::cli {

Result<isp::BenchOptions> bench_options(const BenchArgs& args) {
  const std::string folder = pictures_folder(args.pictures_folder);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(
        ErrorCode::not_found,
        "there is no such folder of pictures: --pictures-folder names the testdata/pictures of lowlux's sources",
        folder);
  }
  isp::BenchOptions options{.pictures_folder = folder, .pictures = args.pictures, .quick = args.quick};
  options.command_limits.max_wall_s = args.time_limit_s;
  options.seed = args.seed;
  options.threads =
      args.threads > 0 ? args.threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.advance = [](double, const std::string&) {};
  return options;
}

Result<MeasuredStage> measure_stage(const isp::BenchStage& stage, const isp::BenchOptions& options,
                                    const std::string& call) {
  const auto start = std::chrono::steady_clock::now();
  auto outcome = stage.run(options);
  if (!outcome) return tl::make_unexpected(outcome.error());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  if (!outcome->settings.empty()) outcome->settings.push_back({"command", call});
  return MeasuredStage{stage, *std::move(outcome), took.count()};
}

}  // namespace lowlux::cli
