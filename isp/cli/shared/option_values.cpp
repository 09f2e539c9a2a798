#include "isp/cli/shared/option_values.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/base/shard.h"
#include "isp/base/text.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/help/help_page.h"
#include "isp/cli/help/help_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {

namespace {

constexpr std::string_view blank_characters = " \t";

/// Returns the text without its unit, which follows it, or precedes it if the unit ends with a slash.
std::string_view without_unit(std::string_view text, std::string_view unit) {
  if (unit.empty() || text.size() <= unit.size()) return text;
  if (unit.ends_with('/')) {
    return same_letters(text.substr(0, unit.size()), unit) ? text.substr(unit.size()) : text;
  }
  const std::size_t rest = text.size() - unit.size();
  if (!same_letters(text.substr(rest), unit)) return text;
  text = text.substr(0, rest);
  return text.substr(0, text.find_last_not_of(blank_characters) + 1);
}

/// Returns the unit of a placeholder in the help; empty if it has none.
std::string_view unit_of(std::string_view placeholder) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> units{{{"S", "s"},
                                                                                {"C", "C"},
                                                                                {"CD_M2", "cd/m2"},
                                                                                {"DN", "DN"},
                                                                                {"E", "e-"},
                                                                                {"UM", "um"},
                                                                                {"PX", "px"},
                                                                                {"PX_PER_S", "px/s"},
                                                                                {"f/N", "f/"}}};
  const auto* const found =
      std::ranges::find(units, placeholder, &std::pair<std::string_view, std::string_view>::first);
  return found == units.end() ? std::string_view() : found->second;
}

/// Returns a hint on a number with a decimal comma; empty if `store` does not accept it with a point either.
std::string decimal_point_hint(std::string text, const OptionStore& store) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) return {};
  text[comma] = '.';
  return store(text) ? std::string() : fmt::format("; write decimals with a point: {}", text);
}

/// Returns the first argument that looks like an option and is not one, with a suggestion; nullopt if all are known.
std::optional<std::string> unknown_option(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining();
  const auto found = std::ranges::find_if(unknown, [](const auto& word) { return word.size() > 1 && word[0] == '-'; });
  if (found == unknown.end() || *found == "--") return std::nullopt;
  std::error_code ignored;
  if (std::filesystem::exists(*found, ignored)) {
    return fmt::format("'{0}' is interpreted as an option; to name a file, write ./{0}", *found);
  }
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string name = found->substr(0, found->find('='));
  return fmt::format("unknown option {}{}", name, suggestion(name, known));
}

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::string> set_shard(std::string_view text, Shard& shard) {
  constexpr std::uint64_t max_count = std::uint64_t{1} << 63;
  const std::size_t slash = text.find('/');
  const auto number = whole_number(text.substr(0, slash));
  const auto count = slash == std::string_view::npos ? std::nullopt : whole_number(text.substr(slash + 1));
  if (!number || !count || *number < 1 || *number > *count || *count > max_count) {
    return "is not I/N with 1 <= I <= N <= 2^63: 1/4 is the first of four shards";
  }
  shard = {*number, *count};
  return std::nullopt;
}

}  // namespace

bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, ascii_lower, ascii_lower);
}

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> quantity_of(std::string_view text, std::string_view unit) {
  text = without_unit(text, unit);
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return number_of(text);
  const auto numerator = number_of(text.substr(0, slash)), denominator = number_of(text.substr(slash + 1));
  if (!numerator || !denominator || !(*denominator >= 1)) return std::nullopt;
  return *numerator / *denominator;
}

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    words.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return words;
}

std::optional<std::vector<double>> numbers_of(const std::string& text, std::size_t most) {
  std::vector<double> numbers;
  for (const std::string& word : split_at_commas(text)) {
    const auto number = number_of(word);
    if (!number || numbers.size() == most) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

CLI::Option* add_text(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                      OptionStore store, Comma comma) {
  return app
      .add_option_function<std::string>(
          flag,
          [store = std::move(store), flag, comma](const std::string& text) {
            const auto wrong = store(text);
            if (!wrong) return;
            const std::string hint = comma == Comma::decimal ? decimal_point_hint(text, store) : std::string();
            throw CLI::ValidationError(flag, fmt::format("'{}' {}{}", text, *wrong, hint));
          },
          help)
      ->type_name(type);
}

CLI::Option* add_bits(CLI::App& app, std::optional<int>& bits) {
  return add_choice<int>(
      app, "--bits", {{"8", 8}, {"16", 16}, {"32", 32}}, [&bits](int chosen) { bits = chosen; },
      "bits per sample (default: PNG, JPEG 8, TIFF, EXR 16, PFM 32)");
}

CLI::Option* add_number(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                        std::function<void(double)> store) {
  return add_text(app, flag, type, help,
                  [store = std::move(store), unit = unit_of(type)](const std::string& text) -> ArgumentError {
                    const auto number = quantity_of(text, unit);
                    if (!number) return "is not a finite number";
                    store(*number);
                    return std::nullopt;
                  });
}

ArgumentError store_number(const std::string& text, const NumberRange& range, double& out) {
  const std::optional<double> number = quantity_of(text, range.unit);
  if (!number || !(*number >= range.low && *number <= range.high)) {
    return fmt::format("{} from {:g} to {:g}{}{}", range.is_not, range.low, range.high, *range.unit == 0 ? "" : " ",
                       range.unit);
  }
  out = *number;
  return std::nullopt;
}

namespace {

/// Returns the name of a verb: "calibrate black".
std::string_view verb_of(const std::string& app_name) {
  constexpr std::string_view command = "lowlux ";
  return std::string_view(app_name).substr(app_name.starts_with(command) ? command.size() : 0);
}

int refuse_as(const CLI::App& app, const std::string& wrong, FailureJson json) {
  const std::string place = default_place(app, wrong);
  print_failure_json({}, {ErrorCode::invalid_argument, wrong, place}, json);
  print_err(fmt::format("{}\n", one_line(fmt::format("{}: {}{}{}; --help lists the options", app.get_name(), place,
                                                     place.empty() ? "" : ": ", wrong))));
  return exit_usage;
}

}  // namespace

int refuse(const CLI::App& app, const std::string& wrong) {
  return refuse_as(app, wrong,
                   failure_json(verb_of(app.get_name()), [&](std::string_view flag, std::string_view value) {
                     const CLI::Option* const option = app.get_option_no_throw(std::string(flag));
                     if (option == nullptr || option->count() == 0) return false;
                     return value.empty() || option->results().back() == value;
                   }));
}

namespace {

/// Parses arguments and defaults. Help and errors are exceptions.
void parse_all(CLI::App& app, const std::vector<std::string>& words, const Defaults& defaults) {
  std::vector<std::string> last_first(words.rbegin(), words.rend());  // as CLI11 takes them
  for (const Defaults::Item& item : defaults.items) last_first.push_back(item.word);
  app.parse(last_first);
}

/// Returns what is wrong with the arguments. CLI11 reports repeated options and unreadable numbers in technical terms,
/// which are replaced, as is "Value 1.5 not in range 1 to 9" of a range of whole numbers.
std::string error_text(const CLI::ParseError& error) {
  std::string text = error.what();
  std::replace(text.begin(), text.end(), '\n', ' ');
  const std::size_t repeated = text.find(": At Most 1 required but received ");
  if (repeated != std::string::npos) return text.substr(0, repeated) + " is given more than once";
  constexpr std::string_view excludes = " excludes ";
  if (const std::size_t both = text.find(excludes); both != std::string::npos) {
    return text.replace(both, excludes.size(), " and ") + " are mutually exclusive";
  }
  constexpr std::string_view value = ": Value ", outside = " not in range ";
  const std::size_t before = text.find(value), after = text.find(outside);
  if (before < after && after != std::string::npos) {
    return fmt::format("{}: '{}' is not a whole number of {}", text.substr(0, before),
                       text.substr(before + value.size(), after - before - value.size()),
                       text.substr(after + outside.size()));
  }
  constexpr std::string_view unreadable = "Could not convert: ";
  const std::size_t equals = text.find(" = ");
  if (!text.starts_with(unreadable) || equals == std::string::npos) return text;
  return fmt::format("{}: '{}' is not a whole number", text.substr(unreadable.size(), equals - unreadable.size()),
                     text.substr(equals + 3));
}

/// Returns the first option whose value is empty, which CLI11 takes for an option that is not given; nullptr: none.
const CLI::Option* empty_option(const CLI::App& app) {
  const auto options = app.get_options([](const CLI::Option* option) {
    return option->nonpositional() && option->get_expected_max() != 0 &&
           std::ranges::find(option->results(), std::string()) != option->results().end();
  });
  return options.empty() ? nullptr : options.front();
}

}  // namespace

std::optional<int> parse_arguments(CLI::App& app, const std::vector<std::string>& words, Defaults* used,
                                   const std::set<std::string>& left_out) {
  app.set_help_flag("-h,--help", "print the most used options")->group("General");
  app.set_help_all_flag("--help-all", "print all options")->group("General");
  bool no_config = false;  // find_defaults looks for the flag itself: defaults are arguments of the parser
  app.add_flag("--no-config", no_config, "ignore the file of defaults: ~/.config/lowlux/config")->group("General");
  if (words.size() == 1 && is_help_form(words.front())) {
    print_out(help_in_form(help_page(app), words.front()).value_or(""));
    return exit_done;
  }
  const FailureJson json = failure_json(verb_of(app.get_name()), words);
  for (const std::string& word : words) {
    if (word == "--") break;
    if (!word.starts_with("--") || !word.ends_with('=')) continue;
    const std::string flag = word.substr(0, word.size() - 1);
    if (app.get_option_no_throw(flag) != nullptr) return refuse_as(app, flag + " has no value", json);
  }
  const Result<Defaults> defaults = find_defaults(app, words, left_out);
  if (!defaults) return print_failure(defaults.error(), json), exit_usage;
  try {
    parse_all(app, words, *defaults);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      const HelpPage page = help_page(app);
      print_out(error.get_name() == "CallForAllHelp" ? full_help(page) : short_help(page));
      return exit_done;
    }
    if (const auto unknown = unknown_option(app)) return refuse_as(app, *unknown, json);
    return refuse_as(app, error_text(error), json);
  }
  if (const CLI::Option* const empty = empty_option(app)) return refuse(app, empty->get_name() + " has no value");
  if (used != nullptr) *used = *defaults;
  return std::nullopt;
}

CLI::Option* add_seed(CLI::App& app, const std::string& flag, const std::string& help, std::uint64_t& seed) {
  return add_text(app, flag, "N", help, [&seed](const std::string& text) -> std::optional<std::string> {
    const auto number = whole_number(text);
    if (!number) return "is not a whole number of 0 to 18446744073709551615";
    seed = *number;
    return std::nullopt;
  });
}

CLI::Option* add_shard(CLI::App& app, const std::string& help, Shard& shard) {
  return add_text(app, "--shard", "I/N", help, [&shard](const std::string& text) { return set_shard(text, shard); });
}

}  // namespace lowlux::cli
