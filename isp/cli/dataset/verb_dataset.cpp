#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/file_bytes.h"
#include "isp/base/json_text.h"
#include "isp/cli/dataset/dataset_args.h"
#include "isp/cli/dataset/dataset_check.h"
#include "isp/cli/dataset/dataset_sample.h"
#include "isp/cli/dataset/dataset_spec.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/interruption.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/verbs.h"
#include "isp/output/atomic_file.h"
#include "isp/output/private_folder.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Returns the number of samples of a shard, and the index of one of them, 0 being the first.
std::uint64_t samples_in(const DatasetSpec& spec, const Shard& shard) {
  return spec.count < shard.number ? 0 : (spec.count - shard.number) / shard.count + 1;
}

std::uint64_t index_in(const DatasetSpec& spec, const Shard& shard, std::uint64_t sample) {
  return spec.first_index + (shard.number - 1) + sample * shard.count;
}

Json head_of(const DatasetSpec& spec) { return {{"lowlux", version_number()}, {"spec_sha256", spec.sha256}}; }

/// Writes dataset.json, which states the spec, the hashes of its files and the version, or checks one that exists. It
/// does not depend on the shard and the count, so that more samples can be added later. Errors: the folder holds
/// samples of another spec or version, and `force` is not given; those of AtomicFile.
Result<void> claim_folder(const DatasetSpec& spec, const std::string& folder, bool force) {
  constexpr std::uint64_t max_bytes = 256 << 20;
  const std::string file = (fs::path(folder) / "dataset.json").string();
  Json json = head_of(spec);
  json.update(Json::parse(spec.identity));
  const std::string text = json_text(json, 1) + "\n";
  const auto same = [&] {
    const auto old = capture::read_file_bytes(file, max_bytes);
    return old && std::string_view(reinterpret_cast<const char*>(old->data()), old->size()) == text;
  };
  if (same()) return {};
  auto written = isp::write_text(file, text, force ? isp::Overwrite::yes : isp::Overwrite::no);
  // Another shard may have written the file meanwhile.
  if (written || written.error().code != ErrorCode::exists || same()) return written ? written : Result<void>{};
  return fail(
      ErrorCode::exists,
      "was made with another spec or version of lowlux: choose another folder, or replace its samples with --force",
      file);
}

/// Writes manifest-I-of-N.json: the files of each sample of a shard with their sizes and SHA-256. Samples go to the
/// disk as they are added, so that memory does not grow with their number.
class Manifest {
 public:
  /// Errors: those of AtomicFile.
  static Result<Manifest> create(const DatasetSpec& spec, const Shard& shard, const std::string& folder);
  Result<void> add(std::uint64_t index, const DatasetSample& sample);
  /// Gives the file its name. Call it once, after all samples.
  Result<void> commit();

 private:
  Manifest(isp::AtomicFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  Result<void> write(std::string_view text);

  isp::AtomicFile file_;
  std::string name_;
  bool first_ = true;
};

Result<Manifest> Manifest::create(const DatasetSpec& spec, const Shard& shard, const std::string& folder) {
  std::string name = (fs::path(folder) / fmt::format("manifest-{}-of-{}.json", shard.number, shard.count)).string();
  auto file = isp::AtomicFile::create(name, isp::Overwrite::yes);
  if (!file) return tl::make_unexpected(file.error());
  Manifest out(*std::move(file), std::move(name));
  Json head = head_of(spec);
  head["shard"] = fmt::format("{}/{}", shard.number, shard.count);
  head["first_index"] = spec.first_index;
  head["count"] = spec.count;
  std::string text = head.dump();
  text.pop_back();
  if (const auto done = out.write(text + ",\n\"samples\": ["); !done) return tl::make_unexpected(done.error());
  return out;
}

Result<void> Manifest::add(std::uint64_t index, const DatasetSample& sample) {
  const char* const separator = std::exchange(first_, false) ? "\n" : ",\n";
  return write(separator + Json{{"index", index}, {"files", Json::parse(sample.files)}}.dump());
}

Result<void> Manifest::commit() {
  return write("\n]}\n").and_then([&] { return file_.commit(); });
}

Result<void> Manifest::write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.file()) == text.size()) return {};
  return fail(ErrorCode::unwritable, "the file cannot be written completely; is the disk full?", name_);
}

/// Holds size and time of one sample.
struct SampleCost {
  double bytes = 0;
  double seconds = 0;
};

struct DatasetOutcome {
  std::uint64_t samples = 0;   // samples of the shard
  std::uint64_t made = 0;      // in this run; the others were complete
  std::uint64_t measured = 1;  // samples whose mean cost is `cost`
  std::optional<SampleCost> cost;
  double bytes = 0;  // bytes of all complete samples
};

Result<DatasetSample> measured_sample(const DatasetSpec& spec, std::uint64_t index, const std::string& folder,
                                      SampleCost& cost) {
  const auto start = std::chrono::steady_clock::now();
  auto sample = make_sample(spec, index, folder);
  cost.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (sample) cost.bytes = static_cast<double>(sample->bytes);
  return sample;
}

std::string time_text(double seconds) {
  if (seconds < 120) return fmt::format("{:.3g} s", seconds);
  if (seconds < 7200) return fmt::format("{:.3g} min", seconds / 60);
  return fmt::format("{:.3g} h", seconds / 3600);
}

std::string size_text(double bytes) {
  return bytes < 1e9 ? fmt::format("{:.3g} MB", bytes / 1e6) : fmt::format("{:.4g} GB", bytes / 1e9);
}

std::string prediction_text(std::uint64_t samples, std::uint64_t measured, const SampleCost& cost) {
  const auto count = static_cast<double>(samples);
  return fmt::format("{} samples, predicted from {}: {} and {}, {:.3g} samples/s", samples, measured,
                     size_text(count * cost.bytes), time_text(count * cost.seconds), 1 / cost.seconds);
}

/// Warns if the predicted bytes exceed the free space of a folder.
void warn_of_space(double bytes, const std::string& folder) {
  std::error_code failed;
  const fs::space_info space = fs::space(folder, failed);
  if (failed || static_cast<double>(space.available) >= bytes) return;
  print_err(one_line(fmt::format("lowlux: {}: warning: the data set is predicted to need {}, and {} are free", folder,
                                 size_text(bytes), size_text(static_cast<double>(space.available)))) +
            "\n");
}

/// Makes a shard.
class ShardRun {
 public:
  ShardRun(const DatasetSpec& spec, const DatasetArgs& args) : spec_(spec), args_(args), progress_(100, !args.quiet) {
    out_.samples = samples_in(spec, args.shard);
  }

  Result<DatasetOutcome> run() {
    std::error_code failed;
    fs::create_directories(args_.output, failed);
    if (!fs::is_directory(args_.output, failed)) {
      return fail(ErrorCode::unwritable, "is not a folder, and cannot be made one", args_.output);
    }
    if (const auto claimed = claim_folder(spec_, args_.output, args_.force); !claimed) {
      return tl::make_unexpected(claimed.error());
    }
    auto manifest = Manifest::create(spec_, args_.shard, args_.output);
    if (!manifest) return tl::make_unexpected(manifest.error());
    const InterruptionReport report([this] {
      return fmt::format("{} of {} samples are complete: repeat the command to continue", done_.load(), out_.samples);
    });
    for (std::uint64_t i = 0; i < out_.samples; ++i) {
      const std::uint64_t index = index_in(spec_, args_.shard, i);
      const auto sample = complete_sample(index, out_.samples - i);
      if (!sample) return tl::make_unexpected(sample.error());
      if (auto added = manifest->add(index, *sample); !added) return tl::make_unexpected(added.error());
      out_.bytes += static_cast<double>(sample->bytes);
      done_ = i + 1;
      progress_.advance(100.0 / static_cast<double>(out_.samples), fmt::format("sample {}", index));
    }
    if (const auto done = manifest->commit(); !done) return tl::make_unexpected(done.error());
    return out_;
  }

 private:
  /// Returns a sample that is complete, or makes it; the first that is made gives the prediction.
  /// @param left  samples from this one on
  Result<DatasetSample> complete_sample(std::uint64_t index, std::uint64_t left) {
    if (auto found = find_sample(spec_, index, args_.output)) return *std::move(found);
    SampleCost cost;
    auto sample = measured_sample(spec_, index, args_.output, cost);
    if (!sample) return sample;
    ++out_.made;
    if (out_.cost) return sample;
    out_.cost = cost;
    if (args_.quiet) return sample;
    progress_.print([&] {
      if (!args_.json) print_out(prediction_text(left, out_.measured, cost) + "\n");
      warn_of_space(static_cast<double>(left - 1) * cost.bytes, args_.output);
    });
    return sample;
  }

  const DatasetSpec& spec_;
  const DatasetArgs& args_;
  Progress progress_;
  DatasetOutcome out_;
  std::atomic<std::uint64_t> done_{0};  // also read when the run is interrupted
};

/// Makes up to 8 samples of a shard, evenly spaced, in a folder that is removed, and returns their mean cost. The first
/// is made twice, as it also takes the time of the first use of code and tables.
Result<DatasetOutcome> dry_run(const DatasetSpec& spec, const DatasetArgs& args) {
  constexpr std::uint64_t max_measured = 8;
  DatasetOutcome out{.samples = samples_in(spec, args.shard)};
  if (out.samples == 0) return out;
  const Result<isp::PrivateFolder> made = isp::PrivateFolder::make();
  if (!made) return tl::make_unexpected(made.error());
  const std::string folder = made->path().string();
  out.measured = std::min(out.samples, max_measured);
  SampleCost cost, sum;
  auto sample = measured_sample(spec, index_in(spec, args.shard, 0), folder, cost);
  for (std::uint64_t i = 0; sample && i < out.measured; ++i) {
    sample = measured_sample(spec, index_in(spec, args.shard, out.samples / out.measured * i), folder, cost);
    sum.bytes += cost.bytes, sum.seconds += cost.seconds;
  }
  if (!sample) return tl::make_unexpected(sample.error());
  const auto count = static_cast<double>(out.measured);
  out.cost = SampleCost{sum.bytes / count, sum.seconds / count};
  return out;
}

std::string outcome_json(const DatasetSpec& spec, const DatasetArgs& args, const DatasetOutcome& outcome) {
  Json json{{"spec_sha256", spec.sha256},
            {"shard", fmt::format("{}/{}", args.shard.number, args.shard.count)},
            {"samples", outcome.samples}};
  if (outcome.cost) {
    const auto count = static_cast<double>(outcome.samples);
    json["measured_samples"] = outcome.measured;
    json["bytes_per_sample"] = outcome.cost->bytes;
    json["seconds_per_sample"] = outcome.cost->seconds;
    json["predicted_bytes"] = count * outcome.cost->bytes;
    json["predicted_seconds"] = count * outcome.cost->seconds;
  }
  if (!args.dry_run) {
    json["made"] = outcome.made;
    json["bytes"] = outcome.bytes;
  }
  return json_text(json, 2);
}

void print_dataset(const DatasetSpec& spec, const DatasetArgs& args, const DatasetOutcome& outcome) {
  if (args.json) return print_out(outcome_json(spec, args, outcome) + "\n");
  if (args.dry_run && outcome.cost)
    return print_out(prediction_text(outcome.samples, outcome.measured, *outcome.cost) + "\n");
  if (args.quiet && !args.dry_run) return;
  print_out(fmt::format("{} samples, {} made, {}\n", outcome.samples, outcome.made, size_text(outcome.bytes)));
}

}  // namespace

int run_dataset(const std::vector<std::string>& words) {
  const Parsed<DatasetArgs> parsed = parse_dataset(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<DatasetArgs>(parsed);
  const Result<DatasetSpec> spec = read_dataset_spec(args.spec);
  if (!spec) return print_failure(args.spec, spec.error(), object_if(args.json));
  {
    InlineExecutor executor;
    if (const auto good = check_dataset(*spec, executor); !good) {
      return print_failure(args.spec, good.error(), object_if(args.json));
    }
  }
  const Result<DatasetOutcome> outcome = args.dry_run ? dry_run(*spec, args) : ShardRun(*spec, args).run();
  if (!outcome) return print_failure(with_file(outcome.error(), args.spec), object_if(args.json));
  print_dataset(*spec, args, *outcome);
  return exit_done;
}

}  // namespace lowlux::cli
