#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lowlux::cli {

/// The whole text as a finite number with a decimal point, with a sign or without; nullopt if it is not one.
std::optional<double> number_of(std::string_view text);

/// A number or a fraction as this program prints it, the unit in any case or left out: "+1.5 EV", "3000K", "1/60 s",
/// "f/2.8" (unit "f/"). Denominators are at least 1. nullopt if the text is anything else.
std::optional<double> quantity_of(std::string_view text, std::string_view unit);

/// Numbers parted by commas, at most `most`; nullopt if one is none or there are more.
std::optional<std::vector<double>> numbers_of(const std::string& text, std::size_t most);

/// Words parted by commas.
std::vector<std::string> words_of(const std::string& text);

template <class Enum>
using Names = std::map<std::string, Enum>;

template <class Enum>
std::string joined(const Names<Enum>& names) {
  std::string text;
  for (const auto& [name, value] : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// Takes the text of an option. @return what is wrong with it, or nothing
using OptionStore = std::function<std::optional<std::string>(const std::string&)>;

/// An option that takes text. Where a decimal comma is what is wrong, the message shows the number with a point.
CLI::Option* add_text(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                      OptionStore store);

/// An option that takes a quantity; `type` names its unit: S, C, CD_M2, DN, E, UM, PX, PX_PER_S or f/N.
CLI::Option* add_number(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                        std::function<void(double)> store);

/// An option whose values are names; the message for any other lists them.
template <class Enum, class Store>
CLI::Option* add_choice(CLI::App& app, const std::string& flag, const Names<Enum>& names, Store store,
                        const std::string& help) {
  return add_text(app, flag, "NAME", help + " (" + joined(names) + ")",
                  [names, store](const std::string& name) -> std::optional<std::string> {
                    const auto found = names.find(name);
                    if (found == names.end()) return "is none of " + joined(names);
                    store(found->second);
                    return std::nullopt;
                  });
}

/// " (did you mean --exposure?)" for a name that is near a known one, empty if none is.
std::string suggestion(std::string_view wanted, std::span<const std::string_view> known);

/// Of --bits, wherever pictures are written.
inline constexpr const char* bits_help = "bits per sample: 8, 16 or 32 (default: PNG, JPEG 8, TIFF, EXR 16, PFM 32)";

/// Prints what is wrong with a command line. @return the exit code
int refuse(const CLI::App& app, const std::string& wrong);

/// Parses the words after a verb. @return nullopt if they are good, else the exit code, help or error having been
/// printed
std::optional<int> parse_words(CLI::App& app, const std::vector<std::string>& words);

}  // namespace lowlux::cli
