#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lowlux::cli {

/// The whole text as a finite number; nullopt if it is none.
std::optional<double> number_of(const std::string& text);

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

/// An option that takes text; `store` returns what is wrong with it, or nothing.
CLI::Option* add_text(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                      std::function<std::optional<std::string>(const std::string&)> store);

/// An option that takes a finite number.
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

/// Prints what is wrong with a command line. @return the exit code
int refuse(const CLI::App& app, const std::string& wrong);

/// Parses the words after a verb. @return nullopt if they are good, else the exit code, help or error having been
/// printed
std::optional<int> parse_words(CLI::App& app, const std::vector<std::string>& words);

}  // namespace lowlux::cli
