#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lowlux {
struct Shard;
}

namespace lowlux::cli {

struct Defaults;

/// States what is wrong with an argument, to be printed after it; nullopt if it is valid.
using ArgumentError = std::optional<std::string>;

/// Returns whether two texts differ at most in the case of letters.
bool same_letters(std::string_view a, std::string_view b);

/// Returns the entire text as a finite number with a decimal point, with or without a sign; nullopt for other text.
std::optional<double> number_of(std::string_view text);

/// Returns a number or a fraction as this program prints it, the unit in any case or left out: "+1.5 EV", "3000K",
/// "1/60 s", "f/2.8" (unit "f/"). Denominators are at least 1. Returns nullopt for any other text.
std::optional<double> quantity_of(std::string_view text, std::string_view unit);

/// Returns numbers separated by commas; nullopt if one is not a number or there are more than `most`.
std::optional<std::vector<double>> numbers_of(const std::string& text, std::size_t most);

/// Returns words separated by commas.
std::vector<std::string> split_at_commas(const std::string& text);

/// Holds the values of an option by name, in the order in which help lists them.
template <class Enum>
class Names {
 public:
  using Item = std::pair<std::string, Enum>;
  Names() = default;
  Names(std::initializer_list<Item> items) : items_(items) {}
  void emplace(std::string_view name, Enum value) { items_.emplace_back(std::string(name), std::move(value)); }
  auto begin() const { return items_.begin(); }
  auto end() const { return items_.end(); }
  auto find(std::string_view name) const {
    return std::find_if(begin(), end(), [name](const Item& item) { return item.first == name; });
  }

 private:
  std::vector<Item> items_;
};

template <class Enum>
std::string joined(const Names<Enum>& names, std::string_view separator = ", ") {
  std::string text;
  for (const auto& [name, value] : names) text.append(text.empty() ? "" : separator).append(name);
  return text;
}

/// Stores the text of an option. @return the error, or nothing
using OptionStore = std::function<ArgumentError(const std::string&)>;

/// States what a comma in a value that is refused can be.
enum class Comma : std::uint8_t { decimal, separator };

/// Adds an option that takes text. If a decimal comma is the error, the message shows the number with a point.
CLI::Option* add_text(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                      OptionStore store, Comma comma = Comma::decimal);

/// Adds an option that takes a quantity; `type` names its unit: S, C, CD_M2, DN, E, UM, PX, PX_PER_S or f/N.
CLI::Option* add_number(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                        std::function<void(double)> store);

/// Describes the values that an option accepts. CLI::Range is not used for them, because it accepts NaN.
struct NumberRange {
  double low;
  double high;
  const char* unit = "";                   // unit that may follow the number
  const char* is_not = "is not a number";  // beginning of the error
};

/// Stores a number that is within a range. @return the error, or nothing
ArgumentError store_number(const std::string& text, const NumberRange& range, double& out);

/// Returns a store for an option that takes a number within a range.
/// @param out  a double, or an optional one
template <class Out>
OptionStore store_within(const NumberRange& range, Out& out) {
  return [range, &out](const std::string& text) -> ArgumentError {
    double number = 0;
    if (auto error = store_number(text, range, number)) return error;
    out = number;
    return std::nullopt;
  };
}

/// Adds an option whose values are names, which are its placeholder; the message for any other lists them.
template <class Enum, class Store>
CLI::Option* add_choice(CLI::App& app, const std::string& flag, const Names<Enum>& names, Store store,
                        const std::string& help) {
  return add_text(app, flag, joined(names, "|"), help, [names, store](const std::string& name) -> ArgumentError {
    const auto found = names.find(name);
    if (found == names.end()) return "is none of " + joined(names);
    store(found->second);
    return std::nullopt;
  });
}

/// Adds an option for a seed, a whole number of 64 bits.
CLI::Option* add_seed(CLI::App& app, const std::string& flag, const std::string& help, std::uint64_t& seed);

/// Adds --shard I/N. @param help  which pieces of work are counted
CLI::Option* add_shard(CLI::App& app, const std::string& help, Shard& shard);

/// Adds --bits of the verbs that write images.
CLI::Option* add_bits(CLI::App& app, std::optional<int>& bits);

/// Prints the error of the arguments. @return the exit code
int refuse(const CLI::App& app, const std::string& wrong);

/// Parses the arguments after a verb. @return nullopt if they are valid, else the exit code, after help or an error was
/// printed
/// @param used      receives the defaults of the user's file that complete the arguments; nullptr: not of interest
/// @param left_out  flags whose defaults are not used
std::optional<int> parse_arguments(CLI::App& app, const std::vector<std::string>& words, Defaults* used = nullptr,
                                   const std::set<std::string>& left_out = {});

}  // namespace lowlux::cli
