#include "isp/cli/help/help_form.h"

#include "isp/cli/help/completion.h"
#include "isp/cli/help/man_page.h"

namespace lowlux::cli {
namespace {

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
