#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

/// Collects what help, manual pages and completion state about a verb, from its options as the parser holds them.
namespace lowlux::cli {

/// Holds one option or argument.
struct HelpEntry {
  std::vector<std::string> flags;    // "-o", "--output"; empty for an argument
  std::string placeholder;           // "OUT", "auto|EV"; empty for a flag
  std::vector<std::string> choices;  // words that the placeholder offers
  std::string help;
  bool required = false;
  bool repeats = false;  // an argument that may be given several times
};

/// Holds a titled section of options.
struct HelpSection {
  std::string title;
  std::vector<HelpEntry> entries;
};

/// Holds the help of a verb.
struct HelpPage {
  std::string verb;  // "develop", "calibrate black"
  std::string description;
  std::vector<HelpEntry> arguments;
  HelpSection front;              // most used options, which --help shows
  std::vector<HelpSection> rest;  // options that --help-all shows in addition
  std::string notes;              // paragraph after the options
  std::vector<std::string_view> examples;
};

/// Returns the page of a verb. Each option is in exactly one section.
HelpPage help_page(const CLI::App& app);

/// Returns all options of a page, the front first.
std::vector<HelpEntry> all_options(const HelpPage& page);

/// Returns the options that the user's file of defaults may set: all but help and --no-config.
std::vector<HelpEntry> default_options(const HelpPage& page);

/// Returns an option as it is typed: "-o, --output OUT".
std::string option_text(const HelpEntry& entry);

/// Returns the usage after the word lowlux: "develop RAW... -o OUT [OPTIONS]".
std::string usage_text(const HelpPage& page);

}  // namespace lowlux::cli
