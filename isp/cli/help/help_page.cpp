#include "isp/cli/help/help_page.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "isp/cli/help/verb_help.h"

namespace lowlux::cli {
namespace {

constexpr std::string_view default_group = "Options", general_group = "General";

/// Returns what stands between separators.
std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    parts.emplace_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

bool is_choice(const std::string& word) {
  return !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
    return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '-' || c == '_';
  });
}

/// Sets placeholder and choices from the type of an option with its checks: "INT:{8,16,32}", "auto|EV".
void set_values(const CLI::Option& option, HelpEntry& entry) {
  const std::string type = option.get_type_name();
  const std::size_t colon = type.find(':');
  const std::string name = type.substr(0, colon);
  const std::string check = colon == std::string::npos ? "" : type.substr(colon + 1);
  if (check.starts_with('{') && check.ends_with('}')) {
    entry.choices = split(check.substr(1, check.size() - 2), ',');
    entry.placeholder = fmt::format("{}", fmt::join(entry.choices, "|"));
    return;
  }
  entry.placeholder = name == "INT" || name == "UINT" || name == "FLOAT" ? "N" : name;
  entry.choices = split(name, '|');
  std::erase_if(entry.choices, [](const std::string& word) { return !is_choice(word); });
}

HelpEntry entry_of(const CLI::Option& option) {
  HelpEntry entry{.help = option.get_description(), .required = option.get_required()};
  for (const std::string& name : option.get_snames()) entry.flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) entry.flags.push_back("--" + name);
  if (entry.flags.empty()) {
    entry.placeholder = option.get_single_name();
    entry.repeats = option.get_items_expected_max() > 1;
  } else if (option.get_type_size() != 0) {
    set_values(option, entry);
  }
  return entry;
}

bool has_flag(const HelpEntry& entry, std::string_view flag) {
  return std::ranges::find(entry.flags, flag) != entry.flags.end();
}

/// Returns the section of an option that is not in front.
std::string group_title(const std::string& verb, const CLI::Option& option, const HelpEntry& entry) {
  if (option.get_group() != default_group) return option.get_group();
  return std::string(option_group(verb, entry.flags.back()));
}

void append(std::vector<HelpSection>& sections, const std::string& title, HelpEntry entry) {
  auto found = std::ranges::find(sections, title, &HelpSection::title);
  if (found == sections.end()) found = sections.insert(sections.end(), HelpSection{title, {}});
  found->entries.push_back(std::move(entry));
}

}  // namespace

HelpPage help_page(const CLI::App& app) {
  const std::string name = app.get_name();
  HelpPage page{.verb = name.substr(std::min(name.find(' ') + 1, name.size())), .description = app.get_description()};
  page.front.title = default_group;
  page.notes = app.get_footer();
  const VerbHelp help = verb_help(page.verb);
  page.examples = help.examples;
  for (const std::string_view flag : help.front) {
    page.front.entries.push_back(entry_of(*app.get_option(std::string(flag))));
  }
  HelpSection general{std::string(general_group), {}};
  for (const CLI::Option* option : app.get_options()) {
    HelpEntry entry = entry_of(*option);
    if (entry.flags.empty()) {
      page.arguments.push_back(std::move(entry));
    } else if (option->get_group() == general_group) {
      general.entries.push_back(std::move(entry));
    } else if (help.front.empty() && option->get_group() == default_group) {
      page.front.entries.push_back(std::move(entry));
    } else if (std::ranges::none_of(help.front, [&](std::string_view flag) { return has_flag(entry, flag); })) {
      const std::string title = group_title(page.verb, *option, entry);
      append(page.rest, title.empty() ? "More" : title, std::move(entry));
    }
  }
  page.rest.push_back(std::move(general));
  return page;
}

std::vector<HelpEntry> all_options(const HelpPage& page) {
  std::vector<HelpEntry> all = page.front.entries;
  for (const HelpSection& section : page.rest) all.insert(all.end(), section.entries.begin(), section.entries.end());
  return all;
}

std::vector<HelpEntry> default_options(const HelpPage& page) {
  std::vector<HelpEntry> options = page.front.entries;
  for (const HelpSection& section : page.rest) {
    if (section.title == general_group) continue;
    options.insert(options.end(), section.entries.begin(), section.entries.end());
  }
  return options;
}

std::string option_text(const HelpEntry& entry) {
  std::string text = fmt::format("{}", fmt::join(entry.flags, ", "));
  if (!entry.placeholder.empty()) text += (text.empty() ? "" : " ") + entry.placeholder;
  return entry.repeats ? text + "..." : text;
}

std::string usage_text(const HelpPage& page) {
  std::string text = page.verb;
  for (const HelpEntry& argument : page.arguments) {
    text += argument.required ? " " + option_text(argument) : fmt::format(" [{}]", option_text(argument));
  }
  for (const HelpEntry& option : all_options(page)) {
    if (option.required) text += fmt::format(" {} {}", option.flags.front(), option.placeholder);
  }
  return text + " [OPTIONS]";
}

}  // namespace lowlux::cli
