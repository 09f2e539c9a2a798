#include "isp/cli/help/completion.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace lowlux::cli {
namespace {

constexpr std::string_view bash_begin = R"(# Completion of lowlux for bash.
declare -gA _lowlux_options=() _lowlux_values=()
)";
constexpr std::string_view bash_end = R"(
_lowlux() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} verb=${COMP_WORDS[1]} name words=
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
