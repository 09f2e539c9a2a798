#include "isp/cli/help/help_files.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/base/text.h"
#include "isp/cli/shared/machine.h"

namespace lowlux::cli {
namespace {

constexpr std::string_view exit_status =
    ".SH EXIT STATUS\n.TP\n0\nsuccess\n.TP\n1\nan input or the work failed\n.TP\n2\nusage error\n";

/// Returns the text as roff prints it unchanged.
std::string roff(std::string_view text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  return text;
}

std::string heading(const std::string& name, std::string_view summary) {
  return fmt::format(".TH {} 1 \"\" \"lowlux {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", roff(upper(name)),
                     version_number(), roff(name), roff(summary));
}

/// Returns the first sentence or clause, without a capital and a full stop, as NAME has it.
std::string summary_of(std::string_view description) {
  std::string text(description.substr(0, std::min(description.find(". "), description.find_first_of(":;("))));
  while (text.ends_with('.') || text.ends_with(' ')) text.pop_back();
  if (!text.empty()) text.front() = ascii_lower(text.front());
  return text;
}

void add_entries(std::string& out, const std::vector<HelpEntry>& entries) {
  for (const HelpEntry& entry : entries) {
    std::string tag;
    for (const std::string& flag : entry.flags) tag += fmt::format("{}\\fB{}\\fR", tag.empty() ? "" : ", ", roff(flag));
    if (!entry.placeholder.empty()) {
      tag += fmt::format("{}\\fI{}\\fR{}", tag.empty() ? "" : " ", roff(entry.placeholder), entry.repeats ? "..." : "");
    }
    out += fmt::format(".TP\n{}\n{}\n", tag, roff(entry.help));
  }
}

constexpr std::string_view bash_begin = R"(# Completion of lowlux for bash.
declare -gA _lowlux_options=() _lowlux_values=()
)";
constexpr std::string_view bash_end = R"(
_lowlux() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} verb=${COMP_WORDS[1]} name words=
  # --option=VALUE is three words
  if [ "$current" = = ]; then current=; elif [ "$previous" = = ]; then previous=${COMP_WORDS[COMP_CWORD - 2]}; fi
  if [ "$COMP_CWORD" -eq 1 ]; then
    for name in "${!_lowlux_options[@]}"; do words+=" ${name%% *}"; done
    words+=' help --help --version'
  elif [ -z "${_lowlux_options[$verb]:-}" ] && [ "$COMP_CWORD" -eq 2 ]; then
    for name in "${!_lowlux_options[@]}"; do [ "${name%% *}" != "$verb" ] || words+=" ${name#* }"; done
  else
    [ -n "${_lowlux_options[$verb]:-}" ] || verb+=" ${COMP_WORDS[2]}"
    words=${_lowlux_values["$verb $previous"]:-}
    if [ -z "$words" ] && [[ $current == -* ]]; then words=${_lowlux_options[$verb]:-}; fi
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current" | sort -u)
}
complete -o bashdefault -o default -F _lowlux lowlux
)";
constexpr std::string_view zsh_begin = R"(#compdef lowlux
typeset -ga _lowlux_verbs=()
)";
constexpr std::string_view zsh_end = R"(
_lowlux() {
  local verb=$words[2]
  if (( CURRENT == 2 )); then
    compadd -- ${(u)_lowlux_verbs%% *} help --help --version
    return
  fi
  local depth=1
  if (( ! ${_lowlux_verbs[(Ie)$verb]} )); then
    if (( CURRENT == 3 )); then
      compadd -- ${${(M)_lowlux_verbs:#$verb *}#* }
      return
    fi
    verb+=" $words[3]"
    depth=2
  fi
  (( ${_lowlux_verbs[(Ie)$verb]} )) || return 1
  shift $depth words
  (( CURRENT -= depth ))
  _lowlux_${verb// /_}
}
_lowlux "$@"
)";
constexpr std::string_view fish_begin = R"(# Completion of lowlux for fish.
complete -c lowlux -n __fish_use_subcommand -f -a help
)";

/// Returns the text within single quotes of a shell.
std::string quoted(std::string_view text, Shell shell) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += shell == Shell::fish ? "\\'" : "'\\''";
    } else if (c == '\\' && shell == Shell::fish) {
      out += "\\\\";
    } else {
      out += c;
    }
  }
  return out + "'";
}

std::string bash_of(const HelpPage& page) {
  std::string out, flags;
  for (const HelpEntry& option : all_options(page)) {
    for (const std::string& flag : option.flags) {
      flags += (flags.empty() ? "" : " ") + flag;
      if (!option.choices.empty()) {
        out += fmt::format("_lowlux_values['{} {}']='{}'\n", page.verb, flag, fmt::join(option.choices, " "));
      }
    }
  }
  return fmt::format("_lowlux_options['{}']='{}'\n", page.verb, flags) + out;
}

/// Returns the text with what _arguments reads as an end escaped.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_of(const HelpPage& page) {
  std::string name = page.verb;
  std::ranges::replace(name, ' ', '_');
  std::string out =
      fmt::format("_lowlux_verbs+=({})\n_lowlux_{}() {{\n  _arguments", quoted(page.verb, Shell::zsh), name);
  for (const HelpEntry& option : all_options(page)) {
    std::string value;
    if (!option.placeholder.empty()) {
      value = fmt::format(":{}:{}", zsh_text(option.placeholder),
                          option.choices.empty() ? "_files" : fmt::format("({})", fmt::join(option.choices, " ")));
    }
    for (const std::string& flag : option.flags) {
      out += " \\\n    " + quoted(fmt::format("*{}[{}]{}", flag, zsh_text(option.help), value), Shell::zsh);
    }
  }
  return out + " \\\n    '*:file:_files'\n}\n";
}

std::string fish_of(const HelpPage& page) {
  const std::size_t space = page.verb.find(' ');
  const std::string verb = page.verb.substr(0, space);
  std::string seen = "__fish_seen_subcommand_from " + verb;
  std::string out = fmt::format("complete -c lowlux -n __fish_use_subcommand -f -a {}\n", verb);
  if (space != std::string::npos) {
    const std::string kind = page.verb.substr(space + 1);
    out += fmt::format("complete -c lowlux -n '{}' -a {}\n", seen, kind);
    seen += "; and __fish_seen_subcommand_from " + kind;
  }
  for (const HelpEntry& option : all_options(page)) {
    out += fmt::format("complete -c lowlux -n '{}'", seen);
    for (const std::string& flag : option.flags) {
      out += flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
    }
    if (!option.choices.empty()) {
      out += fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
    } else if (!option.placeholder.empty()) {
      out += " -r";
    }
    out += fmt::format(" -d {}\n", quoted(option.help, Shell::fish));
  }
  return out;
}

}  // namespace

std::string man_page(const HelpPage& page) {
  std::string name = "lowlux-" + page.verb;
  std::ranges::replace(name, ' ', '-');
  std::string out = heading(name, summary_of(page.description));
  out +=
      fmt::format(".SH SYNOPSIS\n.B lowlux\n{}\n.SH DESCRIPTION\n{}\n", roff(usage_text(page)), roff(page.description));
  if (!page.notes.empty()) out += fmt::format(".PP\n{}\n", roff(page.notes));
  if (!page.arguments.empty()) out += ".SH ARGUMENTS\n";
  add_entries(out, page.arguments);
  out += ".SH OPTIONS\n";
  add_entries(out, page.front.entries);
  for (const HelpSection& section : page.rest) {
    out += fmt::format(".SS {}\n", roff(section.title));
    add_entries(out, section.entries);
  }
  if (!page.examples.empty()) out += ".SH EXAMPLES\n.nf\n";
  for (const std::string_view example : page.examples) out += roff(example) + "\n";
  if (!page.examples.empty()) out += ".fi\n";
  return out.append(exit_status) + ".SH SEE ALSO\n.BR lowlux (1)\n";
}

std::string command_man_page(std::span<const std::pair<std::string_view, std::string_view>> verbs) {
  std::string out = heading("lowlux", "raw developer for low light");
  out +=
      ".SH SYNOPSIS\n.B lowlux\n.I VERB\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\nDevelops raw files taken in low light, "
      "measures cameras and simulates them. Each verb has its own manual page, lowlux\\-VERB(1).\n.SH VERBS\n";
  for (const auto& [name, summary] : verbs) out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(name), roff(summary));
  out += ".SH OPTIONS\n.TP\n\\fB\\-h\\fR, \\fB\\-\\-help\\fR\nlist the verbs\n.TP\n";
  out += "\\fB\\-v\\fR, \\fB\\-\\-version\\fR\nprint the version and what is built in\n";
  return out.append(exit_status);
}

std::optional<Shell> shell_named(std::string_view name) {
  if (name == "bash") return Shell::bash;
  if (name == "zsh") return Shell::zsh;
  if (name == "fish") return Shell::fish;
  return std::nullopt;
}

std::string completion_begin(Shell shell) {
  return std::string(shell == Shell::bash ? bash_begin : shell == Shell::zsh ? zsh_begin : fish_begin);
}

std::string completion_of(const HelpPage& page, Shell shell) {
  return shell == Shell::bash ? bash_of(page) : shell == Shell::zsh ? zsh_of(page) : fish_of(page);
}

std::string completion_end(Shell shell) {
  return std::string(shell == Shell::bash ? bash_end : shell == Shell::zsh ? zsh_end : std::string_view());
}

}  // namespace lowlux::cli
