#include "isp/cli/bench/bench_work.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "denoise/denoiser.h"
#include "isp/bench/stages/methods_bench.h"
#include "isp/cli/shared/module.h"

namespace lowlux::cli {

Result<std::vector<isp::ScoredMethod>> own_methods() {
  std::error_code failed;
  const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe", failed);
  if (failed) return fail(ErrorCode::unreadable, "cannot find the command itself: is /proc mounted?");
  std::vector<isp::ScoredMethod> out;
  for (const denoise::Level level : denoise::all_levels) {
    const std::string_view name = denoise::name_of(level);
    out.push_back({.name = fmt::format("lowlux-{}", name),
                   .command = fmt::format("{} denoise --no-config --quiet --denoise {} -o {{out}} {{in}}",
                                          isp::shell_word(command.string()), name),
                   .ours = true});
  }
  return out;
}

Result<RequestedMethods> requested_methods(const std::vector<std::string>& texts) {
  RequestedMethods out;
  for (const std::string& text : texts) {
    auto method = isp::method_of(text);
    if (method) {
      out.methods.push_back(*std::move(method));
    } else if (method.error().code == ErrorCode::not_found) {
      out.not_installed.push_back(std::move(method.error()));
    } else {
      method.error().where = "--method";
      return tl::make_unexpected(std::move(method.error()));
    }
  }
  return out;
}

Result<void> check_method_names(const std::vector<isp::ScoredMethod>& methods) {
  std::set<std::string> names{isp::name_of_noise_free, isp::name_of_noisy};
  for (const isp::ScoredMethod& method : methods) {
    if (names.insert(method.name).second) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("two methods have the name '{}'", method.name), "--method");
  }
  return {};
}

Result<isp::BenchOptions> bench_options(const BenchArgs& args) {
  const std::string folder = pictures_folder(args.pictures_folder);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(ErrorCode::not_found,
                "there is no such folder of images: --pictures-folder names the testdata/pictures of lowlux's sources",
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
