#include "isp/cli/doctor/installation.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "capture/decoder/decoder_process.h"
#include "capture/decoder/libraw_decoder.h"
#include "isp/cli/capture/capture_list.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/doctor/config_check.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/module.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;
using State = InstalledPart::State;

/// Lets the decoder refuse bytes that are not a raw file: it then works.
InstalledPart find_decoder() {
  constexpr std::array<std::byte, 4096> no_raw_file{};
  const auto decoded = capture::decode_contained(no_raw_file, {});
  if (decoded || decoded.error().code == ErrorCode::unsupported) {
    return {.name = "decoder", .found = capture::decoder_name()};
  }
  return {.name = "decoder", .state = State::broken, .remedy = decoded.error().message};
}

/// Lets the decoder of JPEG XL refuse an empty job.
InstalledPart find_jpeg_xl() {
  constexpr std::array<std::byte, 1> no_job{};
  const auto decoded = capture::decode_contained(no_job, {}, capture::DecoderProgram::libjxl);
  if (decoded || decoded.error().code == ErrorCode::malformed) return {.name = "JPEG XL", .found = "in DNG (libjxl)"};
  return {.name = "JPEG XL", .state = State::missing, .remedy = decoded.error().message};
}

InstalledPart find_machine() {
  const Machine machine = this_machine(threads_of_each(1));
  return {.name = "machine",
          .found = fmt::format("{}, {} processors{}", machine.cpu.value_or("unknown processor"), machine.processors,
                               machine.memory_gib ? fmt::format(", {:.1f} GiB", *machine.memory_gib) : "")};
}

template <class Loaded>
InstalledPart module_part(const char* name, const char* purpose, const Result<Loaded>& loaded) {
  if (loaded) return {.name = name, .found = purpose};
  return {.name = name, .state = State::missing, .remedy = loaded.error().message};
}

InstalledPart find_connected_cameras() {
  const CameraList list = find_cameras();
  std::vector<std::string> names;
  for (const auto* const cameras : {&list.v4l2, &list.libcamera}) {
    for (const capture::CameraListing& camera : *cameras) names.push_back(fmt::format("{} {}", camera.id, camera.name));
  }
  if (!names.empty()) return {.name = "cameras", .found = fmt::format("{}", fmt::join(names, "; "))};
  return {.name = "cameras", .state = State::missing, .remedy = "no camera is connected; files need none"};
}

std::ptrdiff_t count_profiles(const fs::path& folder) {
  std::error_code error;
  std::ptrdiff_t count = 0;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    count += entry->path().extension() == ".json" ? 1 : 0;
  }
  return count;
}

InstalledPart find_profiles() {
  const auto command = command_folder();
  const fs::path folder = command ? (*command / LOWLUX_PROFILE_FOLDER).lexically_normal() : fs::path();
  if (const std::ptrdiff_t count = command ? count_profiles(folder) : 0; count > 0) {
    return {.name = "profiles", .found = fmt::format("{} in {}", count, folder.string())};
  }
  return {.name = "profiles",
          .state = State::missing,
          .remedy = fmt::format(
              "none in {}: `cmake --install` installs them there; they are in calib/profiles of the sources",
              folder.string())};
}

InstalledPart find_cost_table() {
  const int threads = threads_of_each(1);
  const auto kept = kept_cost(threads);
  if (kept) {
    return {.name = "cost table", .found = fmt::format("{}, {} threads", cost_file(threads).value_or(""), threads)};
  }
  return {.name = "cost table",
          .state = State::missing,
          .remedy = kept.error().message +
                    ": times of --budget-ms are rough estimates; `lowlux bench --calibrate-cost` measures them"};
}

InstalledPart find_config() {
  const auto file = config_file();
  if (!file) return {.name = "defaults", .found = "none: neither XDG_CONFIG_HOME nor HOME is set"};
  const auto lines = read_config(*file);
  if (!lines) {
    return {.name = "defaults",
            .state = State::broken,
            .remedy = fmt::format("{}: {}", lines.error().where, lines.error().message)};
  }
  if (lines->empty()) return {.name = "defaults", .found = "none in " + *file};
  if (const std::string unknown = unknown_options(*lines, *file); !unknown.empty()) {
    return {.name = "defaults", .state = State::broken, .remedy = unknown};
  }
  return {.name = "defaults", .found = fmt::format("{} in {}", lines->size(), *file)};
}

InstalledPart find_bench_pictures() {
  const std::string folder = pictures_folder("");
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) return {.name = "bench images", .found = folder};
  return {.name = "bench images",
          .state = State::missing,
          .remedy = "bench and reproduce need --pictures-folder, the testdata/pictures of the sources"};
}

}  // namespace

std::vector<InstalledPart> find_installation() {
  return {find_decoder(),
          find_jpeg_xl(),
          {.name = "kernels", .found = this_machine(1).kernels},
          find_machine(),
          module_part("charts", "colour charts in photographs (OpenCV)", load_chart_detector()),
          module_part("libcamera", "cameras of libcamera", load_libcamera()),
          module_part("peers of bench", "non-local means (OpenCV)", load_nl_means()),
          find_connected_cameras(),
          find_profiles(),
          find_cost_table(),
          find_config(),
          find_bench_pictures()};
}

}  // namespace lowlux::cli
