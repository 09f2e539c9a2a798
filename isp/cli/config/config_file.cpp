#include "isp/cli/config/config_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "capture/file/file_bytes.h"
#include "isp/cli/help/verb_help.h"
#include "isp/cli/shared/lines.h"

namespace lowlux::cli {
namespace {

constexpr std::size_t max_bytes = 1 << 16;
constexpr const char* general_group = "General";  // help and --no-config

using Options = std::set<const CLI::Option*>;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

std::string place_of(const std::string& file, int line) { return fmt::format("{}:{}", file, line); }

/// Returns the options that are given before "--".
Options given_options(const CLI::App& app, const std::vector<std::string>& words) {
  Options given;
  for (const std::string& word : words) {
    if (word == "--") break;
    const std::string name = word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
    if (!name.starts_with('-') || name == "-") continue;
    if (const CLI::Option* option = app.get_option_no_throw(name); option != nullptr) given.insert(option);
  }
  return given;
}

/// Returns the argument of a line; empty for a flag that is off.
Result<std::string> word_of(const ConfigLine& line, const CLI::Option& option, const std::string& place) {
  const std::string flag = "--" + line.option;
  if (option.get_expected_max() != 0 && line.value.empty()) {
    return fail(ErrorCode::invalid_argument, fmt::format("{} has no value", line.option), place);
  }
  if (option.get_expected_max() != 0) return flag + "=" + line.value;
  if (line.value == "yes") return flag;
  if (line.value == "no") return std::string();
  return fail(ErrorCode::invalid_argument, fmt::format("{} must be yes or no, not '{}'", line.option, line.value),
              place);
}

Result<const CLI::Option*> option_of(const CLI::App& app, const ConfigLine& line, const std::string& place) {
  const CLI::Option* option = app.get_option_no_throw("--" + line.option);
  if (option != nullptr && option->get_group() != general_group) return option;
  std::vector<std::string> names;
  for (const CLI::Option* known : app.get_options()) {
    if (known->get_group() == general_group) continue;
    for (const std::string& name : known->get_lnames()) names.push_back(name);
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  return fail(ErrorCode::invalid_argument,
              fmt::format("{} has no option '{}'{}", line.verb, line.option, suggestion(line.option, known)), place);
}

bool is_excluded(const CLI::Option& option, const Options& given) {
  const std::set<CLI::Option*> excluded = option.get_excludes();
  return std::ranges::any_of(excluded, [&](const CLI::Option* other) { return given.contains(other); });
}

/// Holds a default that may be used, and its option.
struct Candidate {
  const CLI::Option* option = nullptr;
  Defaults::Item item;
};

/// Removes defaults that need an option that is neither given nor another default, until all have what they need.
void remove_needy(const Options& given, std::vector<Candidate>& candidates) {
  for (std::size_t before = candidates.size() + 1; candidates.size() < before;) {
    before = candidates.size();
    Options present = given;
    for (const Candidate& candidate : candidates) present.insert(candidate.option);
    std::erase_if(candidates, [&](const Candidate& candidate) {
      const std::set<CLI::Option*> needed = candidate.option->get_needs();
      return !std::ranges::all_of(needed, [&](const CLI::Option* other) { return present.contains(other); });
    });
  }
}

/// Returns whether a text names an option, and not only one that begins with its name.
bool names_option(std::string_view text, const std::string& flag) {
  for (std::size_t at = text.find(flag); at != std::string_view::npos; at = text.find(flag, at + 1)) {
    const std::size_t end = at + flag.size();
    const bool is_longer = end < text.size() && (text[end] == '-' || (text[end] >= 'a' && text[end] <= 'z'));
    if (!is_longer) return true;
  }
  return false;
}

/// Returns whether an option has the value that a line of the file gives it.
bool is_set_by(const ConfigLine& line, const CLI::Option& option) {
  if (option.count() == 0) return false;
  return option.get_expected_max() == 0 ? line.value == "yes" : option.results().front() == line.value;
}

}  // namespace

bool Defaults::sets(std::string_view flag) const { return std::ranges::find(items, flag, &Item::flag) != items.end(); }

std::optional<std::string> config_file() {
  // NOLINTBEGIN(concurrency-mt-unsafe): nothing here sets variables
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  const char* const home = std::getenv("HOME");
  // NOLINTEND(concurrency-mt-unsafe)
  if (config != nullptr && *config == '/') return (std::filesystem::path(config) / "lowlux" / "config").string();
  if (home == nullptr || *home == '\0') return std::nullopt;
  return (std::filesystem::path(home) / ".config" / "lowlux" / "config").string();
}

Result<std::vector<ConfigLine>> parse_config(std::string_view text, const std::string& file) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  std::vector<ConfigLine> lines;
  std::string verb;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find('\n')), line = trimmed(whole);
    text.remove_prefix(std::min(whole.size() + 1, text.size()));
    if (line.empty() || line.starts_with('#')) continue;
    const auto wrong = [&](const std::string& why) {
      return fail(ErrorCode::invalid_argument, why, place_of(file, number));
    };
    if (line.starts_with('[') && line.ends_with(']')) {
      verb = trimmed(line.substr(1, line.size() - 2));
      if (!verb_help(verb).examples.empty()) continue;
      return wrong(fmt::format("unknown verb '{}'; `lowlux --help` lists the verbs", verb));
    }
    const std::size_t equals = line.find('=');
    const std::string_view option = trimmed(line.substr(0, equals));
    if (equals == std::string_view::npos || option.empty()) return wrong("a line must be [VERB] or option = value");
    if (verb.empty()) return wrong("a line [VERB], such as [develop], must come first");
    lines.push_back({verb, std::string(option), std::string(trimmed(line.substr(equals + 1))), number});
  }
  return lines;
}

Result<std::vector<ConfigLine>> read_config(const std::string& file) {
  std::error_code error;
  const bool is_there = std::filesystem::exists(file, error) || error == std::errc::too_many_symbolic_link_levels;
  if (!is_there) return std::vector<ConfigLine>();
  const auto bytes = capture::read_file_bytes(file, max_bytes);
  if (!bytes) return fail(bytes.error().code, bytes.error().message, file);
  return parse_config(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), file);
}

Result<Defaults> find_defaults(const CLI::App& app, const std::vector<std::string>& words,
                               const std::set<std::string>& left_out) {
  const Options given = given_options(app, words);
  const auto file = config_file();
  const bool general =
      std::ranges::any_of(given, [](const auto* option) { return option->get_group() == general_group; });
  if (!file || general || app.get_name() == "lowlux doctor") return Defaults{};
  const auto lines = read_config(*file);
  if (!lines) return tl::make_unexpected(lines.error());
  std::vector<Candidate> candidates;
  std::set<std::string> seen;
  for (const ConfigLine& line : *lines) {
    if (app.get_name() != "lowlux " + line.verb) continue;
    const std::string place = place_of(*file, line.number);
    const auto option = option_of(app, line, place);
    if (!option) return tl::make_unexpected(option.error());
    const auto word = word_of(line, **option, place);
    if (!word) return tl::make_unexpected(word.error());
    if (!seen.insert(line.option).second) {
      return fail(ErrorCode::invalid_argument, fmt::format("{} is set twice", line.option), place);
    }
    const std::string flag = "--" + line.option;
    const bool is_open = !given.contains(*option) && !is_excluded(**option, given) && !left_out.contains(flag);
    if (!word->empty() && is_open) candidates.push_back({*option, {flag, *word, place}});
  }
  remove_needy(given, candidates);
  Defaults defaults{.file = candidates.empty() ? "" : *file};
  for (Candidate& candidate : candidates) defaults.items.push_back(std::move(candidate.item));
  return defaults;
}

std::set<std::string> excluded_defaults(const Defaults& defaults,
                                        const std::function<bool(const std::set<std::string>& left_out)>& contradicts) {
  std::set<std::string> excluded;
  if (defaults.items.empty() || !contradicts({})) return excluded;
  std::set<std::string> others;
  for (const Defaults::Item& item : defaults.items) others.insert(item.flag);
  for (const Defaults::Item& item : defaults.items) {
    others.erase(item.flag);
    if (contradicts(others)) excluded.insert(item.flag);
    others.insert(item.flag);
  }
  return excluded;
}

std::string default_place(const CLI::App& app, std::string_view text) {
  const CLI::Option* const no_config = app.get_option_no_throw("--no-config");
  const auto file = config_file();
  if (!file || (no_config != nullptr && no_config->count() > 0)) return {};
  const auto lines = read_config(*file);
  if (!lines) return {};
  for (const ConfigLine& line : *lines) {
    const CLI::Option* const option = app.get_option_no_throw("--" + line.option);
    const bool is_used = app.get_name() == "lowlux " + line.verb && option != nullptr && is_set_by(line, *option);
    if (is_used && names_option(text, "--" + line.option)) return place_of(*file, line.number);
  }
  return {};
}

std::string default_place(const Defaults& defaults, std::string_view text) {
  const auto found =
      std::ranges::find_if(defaults.items, [&](const auto& item) { return names_option(text, item.flag); });
  return found == defaults.items.end() ? std::string() : found->line;
}

std::string defaults_text(const Defaults& defaults) {
  std::string text;
  for (const Defaults::Item& item : defaults.items) text += item.word + " ";
  return text + "(" + defaults.file + ")";
}

}  // namespace lowlux::cli
