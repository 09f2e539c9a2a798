#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "isp/cli/doctor/installation.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;
using State = InstalledPart::State;

const char* name_of(State state) {
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
              part.state == State::works ? part.found : fmt::format("{}: {}", name_of(part.state), part.remedy));
  }
  print_out(fmt::format("lowlux {}\n{}", version_number(), lines.text()));
}

void print_json(const std::vector<InstalledPart>& parts) {
  Json json{{"lowlux", version_number()}, {"parts", Json::array()}};
  for (const InstalledPart& part : parts) {
    json["parts"].push_back({{"name", part.name},
                             {"state", name_of(part.state)},
                             {"found", part.found.empty() ? Json(nullptr) : Json(part.found)},
                             {"remedy", part.remedy.empty() ? Json(nullptr) : Json(part.remedy)}});
  }
  print_out(fmt::format("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace)));
}

}  // namespace

int run_doctor(const std::vector<std::string>& words) {
  CLI::App app(
      "States what is installed (decoder, kernels, modules, cameras, profiles, cost table), what is missing, and what "
      "would help. The exit status is 1 if raw files cannot be developed.",
      "lowlux doctor");
  bool json = false;
  app.add_flag("--json", json, "print JSON instead of text");
  if (const auto code = parse_words(app, words)) return *code;
  const std::vector<InstalledPart> parts = find_installation();
  json ? print_json(parts) : print_parts(parts);
  return std::ranges::any_of(parts, [](const auto& part) { return part.state == State::broken; }) ? exit_failed
                                                                                                  : exit_done;
}

}  // namespace lowlux::cli
