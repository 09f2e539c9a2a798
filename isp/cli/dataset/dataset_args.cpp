#include "isp/cli/dataset/dataset_args.h"

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::string> set_shard(std::string_view text, Shard& shard) {
  constexpr std::uint64_t max_count = std::uint64_t{1} << 63;
  const std::size_t slash = text.find('/');
  const auto number = whole_number(text.substr(0, slash));
  const auto count = slash == std::string_view::npos ? std::nullopt : whole_number(text.substr(slash + 1));
  if (!number || !count || *number < 1 || *number > *count || *count > max_count) {
    return "is not I/N with 1 <= I <= N <= 2^63: 1/4 is the first of four shards";
  }
  shard = {*number, *count};
  return std::nullopt;
}

}  // namespace

Parsed<DatasetArgs> parse_dataset(const std::vector<std::string>& words) {
  CLI::App app(
      "Make a data set of simulated raw files: scenes, sensors and settings drawn from distributions. Each sample is a "
      "raw file, its noise-free truth, a mask and its parameters. A run that ended early continues if it is repeated.",
      "lowlux dataset");
  DatasetArgs args;
  app.add_option("SPEC", args.spec, "description of the data set: a JSON file, see docs/using.md")->required();
  app.add_option("-o,--output", args.output, "folder of the samples")->type_name("DIR");
  add_text(app, "--shard", "I/N", "make every N-th sample from the I-th on (default 1/1: all)",
           [&args](const std::string& text) { return set_shard(text, args.shard); });
  app.add_flag("--dry-run", args.dry_run, "predict bytes and time from up to 8 samples; write nothing to DIR");
  app.add_flag("--force", args.force, "replace samples of another spec or version in DIR");
  app.add_flag("--json", args.json, "one JSON object on stdout");
  app.add_flag("--quiet", args.quiet, "no warnings and no progress");
  if (const auto code = parse_words(app, words)) return *code;
  if (args.output.empty() && !args.dry_run) return refuse(app, "-o is required: the folder of the samples");
  return args;
}

}  // namespace lowlux::cli
