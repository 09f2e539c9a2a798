#include "isp/cli/help/man_page.h"

#include <algorithm>

#include <fmt/format.h>

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

}  // namespace lowlux::cli
