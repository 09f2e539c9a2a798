#include "isp/cli/option_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/exit_code.h"

namespace lowlux::cli {

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    words.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return words;
}

std::optional<std::vector<double>> numbers_of(const std::string& text, std::size_t most) {
  std::vector<double> numbers;
  for (const std::string& word : words_of(text)) {
    const auto number = number_of(word);
    if (!number || numbers.size() == most) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

CLI::Option* add_text(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                      std::function<std::optional<std::string>(const std::string&)> store) {
  return app
      .add_option_function<std::string>(
          flag,
          [store = std::move(store), flag](const std::string& text) {
            if (const auto wrong = store(text)) throw CLI::ValidationError(flag, fmt::format("'{}' {}", text, *wrong));
          },
          help)
      ->type_name(type);
}

CLI::Option* add_number(CLI::App& app, const std::string& flag, const std::string& type, const std::string& help,
                        std::function<void(double)> store) {
  return add_text(app, flag, type, help,
                  [store = std::move(store)](const std::string& text) -> std::optional<std::string> {
                    const auto number = number_of(text);
                    if (!number) return "is not a finite number";
                    store(*number);
                    return std::nullopt;
                  });
}

int refuse(const CLI::App& app, const std::string& wrong) {
  fmt::print(stderr, "{}: {}; --help lists the options\n", app.get_name(), wrong);
  return exit_usage;
}

std::optional<int> parse_words(CLI::App& app, const std::vector<std::string>& words) {
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 takes them last first
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // help
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    return refuse(app, text);
  }
  return std::nullopt;
}

}  // namespace lowlux::cli
