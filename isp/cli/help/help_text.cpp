#include "isp/cli/help/help_text.h"

#include <algorithm>

#include <fmt/format.h>

#include "isp/cli/help/help_files.h"

namespace lowlux::cli {
namespace {

constexpr std::size_t help_column = 26;

void add_entry(std::string& out, const HelpEntry& entry) {
  std::string line = "  " + option_text(entry);
  if (entry.help.empty()) {
    out += line + "\n";
    return;
  }
  if (line.size() + 2 > help_column) {
    out += line + "\n";
    line.clear();
  }
  line.resize(help_column, ' ');
  out += line + wrapped(entry.help, help_column, help_column) + "\n";
}

void add_section(std::string& out, const std::string& title, const std::vector<HelpEntry>& entries) {
  if (entries.empty()) return;
  out += "\n" + (title.empty() ? "" : title + ":\n");
  for (const HelpEntry& entry : entries) add_entry(out, entry);
}

std::string beginning(const HelpPage& page) {
  std::string out = wrapped(page.description, 0, 0) + "\n\n";
  out += wrapped(fmt::format("Usage: lowlux {}", usage_text(page)), 4, 0) + "\n";
  add_section(out, "Arguments", page.arguments);
  add_section(out, page.front.title, page.front.entries);
  return out;
}

void add_end(std::string& out, const HelpPage& page) {
  if (!page.notes.empty()) out += "\n" + wrapped(page.notes, 0, 0) + "\n";
  if (page.examples.empty()) return;
  out += "\nExamples:\n";
  for (const std::string_view example : page.examples) out += fmt::format("  {}\n", example);
}

/// Returns the names of the options that the user's file of defaults may set, one in a line.
std::string option_names(const HelpPage& page) {
  std::string names;
  for (const HelpEntry& option : default_options(page)) {
    for (const std::string& flag : option.flags) {
      if (flag.starts_with("--")) names += flag.substr(2) + "\n";
    }
  }
  return names;
}

constexpr std::string_view prefix = "--help-";

std::string form_of(const std::string& argument) {
  return argument.starts_with(prefix) ? argument.substr(prefix.size()) : std::string();
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t indent, std::size_t used, std::size_t width) {
  std::string out;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (!out.empty()) {
      const bool fits = used + 1 + word.size() <= width;
      out += fits ? " " : "\n" + std::string(indent, ' ');
      used = fits ? used + 1 : indent;
    }
    out += word;
    used += word.size();
  }
  return out;
}

std::string short_help(const HelpPage& page) {
  std::string out = beginning(page);
  add_end(out, page);
  std::size_t more = 0;
  for (const HelpSection& section : page.rest) more += section.entries.size();
  return out + fmt::format("\n`lowlux {} --help-all` lists {} more options.\n", page.verb, more);
}

std::string full_help(const HelpPage& page) {
  std::string out = beginning(page);
  for (const HelpSection& section : page.rest) add_section(out, section.title, section.entries);
  add_end(out, page);
  return out;
}

bool is_help_form(const std::string& argument) {
  const std::string form = form_of(argument);
  return form == "name" || form == "man" || form == "options" || shell_named(form);
}

std::optional<std::string> help_in_form(const HelpPage& page, const std::string& argument) {
  const std::string form = form_of(argument);
  if (form == "name") return page.verb + "\n";
  if (form == "man") return man_page(page);
  if (form == "options") return option_names(page);
  if (const auto shell = shell_named(form)) return completion_of(page, *shell);
  return std::nullopt;
}

}  // namespace lowlux::cli
