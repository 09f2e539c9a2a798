#include "isp/cli/dataset/manifest.h"

#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/file_bytes.h"
#include "isp/cli/shared/machine.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

Json head_of(const DatasetSpec& spec) { return {{"lowlux", version_number()}, {"spec_sha256", spec.sha256}}; }

}  // namespace

std::uint64_t samples_in(const DatasetSpec& spec, const Shard& shard) {
  return spec.count < shard.number ? 0 : (spec.count - shard.number) / shard.count + 1;
}

std::uint64_t index_in(const DatasetSpec& spec, const Shard& shard, std::uint64_t sample) {
  return spec.first_index + (shard.number - 1) + sample * shard.count;
}

Result<void> claim_folder(const DatasetSpec& spec, const std::string& folder, bool force) {
  constexpr std::uint64_t max_bytes = 256 << 20;
  const std::string file = (std::filesystem::path(folder) / "dataset.json").string();
  Json json = head_of(spec);
  json.update(Json::parse(spec.identity));
  const std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  const auto same = [&] {
    const auto old = capture::read_file_bytes(file, max_bytes);
    return old && std::string_view(reinterpret_cast<const char*>(old->data()), old->size()) == text;
  };
  if (same()) return {};
  auto written = isp::write_text(file, text, force ? isp::Overwrite::yes : isp::Overwrite::no);
  // Another shard may have written the file meanwhile.
  if (written || written.error().code != ErrorCode::exists || same()) return written ? written : Result<void>{};
  return fail(ErrorCode::exists,
              "states another spec or version of lowlux: choose another folder, or replace its samples with --force",
              file);
}

Result<Manifest> Manifest::create(const DatasetSpec& spec, const Shard& shard, const std::string& folder) {
  std::string name =
      (std::filesystem::path(folder) / fmt::format("manifest-{}-of-{}.json", shard.number, shard.count)).string();
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

}  // namespace lowlux::cli
