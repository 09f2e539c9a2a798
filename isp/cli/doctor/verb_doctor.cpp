#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "capture/decoder/decoder_name.h"
#include "capture/decoder/decoder_process.h"
#include "isp/base/json_text.h"
#include "isp/cli/capture/capture_list.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

/// Holds what was found of one part of the installation.
struct InstalledPart {
  enum class State { works, missing, broken };
  std::string name;  // "decoder"
  State state = State::works;
  std::string found;   // what works; empty if nothing does
  std::string remedy;  // what is missing, and what would help; empty if nothing is
};

namespace fs = std::filesystem;
using State = InstalledPart::State;
using Json = nlohmann::ordered_json;

/// Returns the parts of a text that are not empty.
std::vector<std::string> parts_of(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    if (end > start) parts.emplace_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

std::string text_of_pipe(int descriptor) {
  std::string text;
  std::array<char, 4096> block{};
  for (;;) {
    const ssize_t got = ::read(descriptor, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(block.data(), static_cast<std::size_t>(got));
  }
}

/// Runs this command with arguments, and returns its standard output; nullopt if it could not be run or failed.
std::optional<std::string> output_of_command(std::vector<std::string> words) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  words.insert(words.begin(), "lowlux");
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failure = posix_spawn(&child, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text = failure == 0 ? text_of_pipe(ends[0]) : std::string();
  close(ends[0]);
  int status = 0;
  const bool is_done = failure == 0 && waitpid(child, &status, 0) == child && WIFEXITED(status);
  if (!is_done || WEXITSTATUS(status) != 0) return std::nullopt;
  return text;
}

/// Returns the names of the options of a verb, "calibrate black" for example; empty if they cannot be listed.
std::vector<std::string> option_names(const std::string& verb) {
  std::vector<std::string> words = parts_of(verb, ' ');
  words.emplace_back("--help-options");
  const auto text = output_of_command(std::move(words));
  return text ? parts_of(*text, '\n') : std::vector<std::string>();
}

/// Returns the lines of the user's file that set an option that their verb does not have, with the nearest one that it
/// has: "FILE:2: develop has no option 'exposre' (did you mean exposure?)", separated by "; "; empty if there are none.
/// The command itself is started to list the options of each verb: only the parser of a verb knows them.
std::string unknown_options(const std::vector<ConfigLine>& lines, const std::string& file) {
  std::map<std::string, std::vector<std::string>> names_of;  // by verb
  std::string text;
  for (const ConfigLine& line : lines) {
    const auto [found, is_new] = names_of.try_emplace(line.verb);
    if (is_new) found->second = option_names(line.verb);
    const std::vector<std::string>& names = found->second;
    if (names.empty() || std::ranges::find(names, line.option) != names.end()) continue;
    const std::vector<std::string_view> known(names.begin(), names.end());
    text += fmt::format("{}{}:{}: {} has no option '{}'{}", text.empty() ? "" : "; ", file, line.number, line.verb,
                        line.option, suggestion(line.option, known));
  }
  return text;
}

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
  return {.name = "cameras", .state = State::missing, .remedy = "no camera is connected; none is needed for files"};
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

/// Tries every part of lowlux on this machine. The decoder and the file of defaults can be broken: develop then fails.
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

const char* state_name(State state) {
  switch (state) {
    case State::works:
      return "works";
    case State::missing:
      return "missing";
    case State::broken:
      break;
  }
  return "broken";
}

void print_parts(const std::vector<InstalledPart>& parts) {
  Lines lines;
  for (const InstalledPart& part : parts) {
    lines.add(part.name,
              part.state == State::works ? part.found : fmt::format("{}: {}", state_name(part.state), part.remedy));
  }
  print_out(fmt::format("lowlux {}\n{}", version_number(), lines.text()));
}

void print_json(const std::vector<InstalledPart>& parts) {
  Json json{{"lowlux", version_number()}, {"parts", Json::array()}};
  for (const InstalledPart& part : parts) {
    json["parts"].push_back({{"name", part.name},
                             {"state", state_name(part.state)},
                             {"found", part.found.empty() ? Json(nullptr) : Json(part.found)},
                             {"remedy", part.remedy.empty() ? Json(nullptr) : Json(part.remedy)}});
  }
  print_out(fmt::format("{}\n", json_text(json, 2)));
}

}  // namespace

int run_doctor(const std::vector<std::string>& words) {
  CLI::App app(
      "States what is installed (decoder, kernels, modules, cameras, profiles, cost table), what is missing, and what "
      "would help. The exit status is 1 if raw files cannot be developed.",
      "lowlux doctor");
  bool json = false;
  app.add_flag("--json", json, "print JSON instead of text");
  if (const auto code = parse_arguments(app, words)) return *code;
  const std::vector<InstalledPart> parts = find_installation();
  json ? print_json(parts) : print_parts(parts);
  return std::ranges::any_of(parts, [](const auto& part) { return part.state == State::broken; }) ? exit_failed
                                                                                                  : exit_done;
}

}  // namespace lowlux::cli
