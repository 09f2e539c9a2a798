#include "isp/cli/dataset/dataset_sample.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/file_bytes.h"
#include "isp/base/json_text.h"
#include "isp/cli/dataset/dataset_draw.h"
#include "isp/cli/dataset/sample_arrays.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/simulate/simulate_files.h"
#include "isp/cli/simulate/simulate_work.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string stem_of(std::uint64_t index, const std::string& folder) {
  return (fs::path(folder) / fmt::format("{:012}", index)).string();
}

Json file_json(const std::string& name, std::uint64_t bytes, const std::string& sha256) {
  return {{"name", name}, {"bytes", bytes}, {"sha256", sha256}};
}

/// Returns the sample that a text of parameters describes.
DatasetSample sample_of(Json files, const std::string& name, std::string_view parameters) {
  files.push_back(file_json(name, parameters.size(), sha256_of(parameters)));
  DatasetSample sample{json_text(files), 0};
  for (const Json& file : files) sample.bytes += file["bytes"].get<std::uint64_t>();
  return sample;
}

/// Returns the parameters of a sample; nullopt if the file is missing or damaged.
std::optional<std::string> read_parameters(const std::string& file) {
  constexpr std::uint64_t max_bytes = 4 << 20;
  const auto bytes = capture::read_file_bytes(file, max_bytes);
  if (!bytes) return std::nullopt;
  std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (nests_deeper(text, max_json_depth)) return std::nullopt;
  return text;
}

/// Returns whether a name is that of a file of a sample: its number, and no digit after it, in no other folder.
bool is_of_sample(const std::string& name, const std::string& number) {
  return name.starts_with(number) && name.size() > number.size() &&
         (name[number.size()] == '.' || name[number.size()] == '_') && name.find('/') == std::string::npos;
}

/// Removes the parameters of an older sample of the same number, and the files that they list. It may have more files
/// than the new one.
void remove_old_sample(const std::string& stem) {
  const std::string file = stem + ".json", number = fs::path(stem).filename().string();
  std::error_code ignored;
  if (const auto text = read_parameters(file)) {
    try {
      const Json json = Json::parse(*text);
      for (const Json& part : json.at("files")) {
        const auto name = part.at("name").get<std::string>();
        if (is_of_sample(name, number)) fs::remove(fs::path(stem).replace_filename(name), ignored);
      }
    } catch (const Json::exception&) {
      // The file is of another program, or damaged: it lists no files.
    }
  }
  fs::remove(file, ignored);
}

/// Returns what the tags of a DNG of the frame state, in the form of `info --json`, and the gain of its codes.
Json raw_json(const RawFrame& frame, const SensorModel& sensor) {
  const Json info = Json::parse(info_json("", frame, std::nullopt));
  const double black_dn = frame.raw.black_tag->pattern_dn[0], white_dn = std::round(frame.raw.white_dn[0]);
  // Codes of sensors without quantisation are stored in units of a whole fraction of a DN.
  const double range_dn = sensor.system_gain_dn_per_e * isp::saturation_charge_e(sensor);
  const double scale = std::max(1.0, std::round((white_dn - black_dn) / range_dn));
  Json out{{"black_level_dn", black_dn},
           {"white_level_dn", white_dn},
           {"gain_e_per_dn", 1 / (scale * sensor.system_gain_dn_per_e)}};
  for (const char* key : {"cfa", "active", "default_crop", "masked", "noise_profile", "exposure", "colour"}) {
    out[key] = info[key];
  }
  return out;
}

/// Writes one sample, and removes its files unless they are complete.
class SampleFiles {
 public:
  SampleFiles(const DatasetSpec& spec, std::uint64_t index, const std::string& folder)
      : spec_(spec), index_(index), stem_(stem_of(index, folder)), draw_(draw_sample(spec, index)) {}
  SampleFiles(const SampleFiles&) = delete;
  SampleFiles& operator=(const SampleFiles&) = delete;
  ~SampleFiles() {
    std::error_code ignored;
    for (const std::string& file : started_) fs::remove(file, ignored);
  }

  Result<DatasetSample> make() {
    auto args = simulate_args(spec_, draw_);
    if (!args) return tl::make_unexpected(with_index(args.error()));
    args->output = stem_ + ".dng";
    args->force = true;
    if (spec_.truth_electrons) args->truth_electrons = stem_ + ".electrons.exr";
    const SimulateFiles files = files_of(*args);
    const SampleFormat format = spec_.format.value_or(SampleFormat::dng);
    SampleArrays arrays(format, files, stem_, spec_.mask);
    started_ = arrays.files();
    started_.push_back(stem_ + ".json");
    const SimulationTaker take = taker(*args, files, arrays);
    if (format == SampleFormat::dng) {
      started_.insert(started_.end(), files.frames.begin(), files.frames.end());
      for (const std::string& file : {files.truth, files.truth_electrons}) {
        if (!file.empty()) started_.push_back(file);
      }
    } else {
      args->output.clear();
    }
    remove_old_sample(stem_);
    const auto outcome = simulate(*args, nullptr, take);
    if (!outcome) return tl::make_unexpected(with_index(outcome.error()));
    if (const auto done = arrays.finish(); !done) return tl::make_unexpected(with_index(done.error()));
    std::vector<std::string> written = outcome->files;
    for (const std::string& file : arrays.files()) written.push_back(file);
    return finish(written);
  }

 private:
  /// Returns what writes the arrays of the sample. The arguments have to live as long.
  SimulationTaker taker(const SimulateArgs& args, const SimulateFiles& files, SampleArrays& arrays) {
    SimulationTaker take;
    take.frame = [this, &args, &arrays](const RawFrame& frame, int i, const SimulateOutcome& so_far) -> Result<void> {
      if (i == 0) {
        set_parameters(frame, args, so_far);
        if (auto begun = arrays.begin(frame.raw, metadata()); !begun) return begun;
      }
      const auto mask = spec_.mask ? mask_of(frame, args, so_far.sensor.model) : Plane<std::uint8_t>();
      return arrays.add_frame(frame.raw, i, mask);
    };
    if (spec_.format.value_or(SampleFormat::dng) == SampleFormat::dng) return take;
    if (!files.truth.empty()) take.truth = [&arrays](const SceneLinear& truth) { return arrays.add_truth(truth); };
    if (!files.truth_electrons.empty()) {
      take.truth_e = [&arrays](const SceneLinear& electrons) { return arrays.add_electrons(electrons); };
    }
    return take;
  }

  /// Sets the parameters but for the files.
  void set_parameters(const RawFrame& frame, const SimulateArgs& args, const SimulateOutcome& outcome) {
    const Json report = Json::parse(simulate_json(args, outcome));
    parameters_ = {{"lowlux", version_number()},
                   {"spec_sha256", spec_.sha256},
                   {"index", index_},
                   {"scene", draw_.scene},
                   {"drawn", Json::object()}};
    for (const auto& [key, value] : draw_.settings) parameters_["drawn"][key] = Json::parse(value);
    for (const char* key : {"exposure_s", "temperature_c", "f_number", "white_luminance_cd_m2",
                            "saturation_luminance_cd_m2", "sensor", "warnings"}) {
      if (report.contains(key)) parameters_[key] = report[key];
    }
    if (spec_.format) parameters_["raw"] = raw_json(frame, outcome.sensor.model);
  }

  /// Returns the parameters as texts: those that are not are JSON.
  std::map<std::string, std::string> metadata() const {
    std::map<std::string, std::string> out;
    for (const auto& [key, value] : parameters_.items()) {
      out[key] = value.is_string() ? value.get<std::string>() : json_text(value);
    }
    return out;
  }

  /// Writes the parameters.
  Result<DatasetSample> finish(const std::vector<std::string>& written) {
    Json files = Json::array();
    for (const std::string& file : written) {
      const auto hash = sha256_of_file(file);
      if (!hash) return tl::make_unexpected(hash.error());
      files.push_back(file_json(fs::path(file).filename().string(), hash->bytes, hash->sha256));
    }
    parameters_["files"] = files;
    const std::string text = json_text(parameters_, 1) + "\n";
    if (const auto done = isp::write_text(stem_ + ".json", text, isp::Overwrite::yes); !done) {
      return tl::make_unexpected(done.error());
    }
    started_.clear();
    return sample_of(std::move(files), fs::path(stem_ + ".json").filename().string(), text);
  }

  /// Returns the error with scene and index, which find the sample again; the caller adds the spec's file.
  Error with_index(Error error) const {
    if (error.code == ErrorCode::unwritable) return error;
    const std::string place = error.where.empty() ? "" : error.where + ": ";
    return {
        error.code, in_keys(fmt::format("sample {}, scene {}: {}{}", index_, draw_.scene, place, error.message)), {}};
  }

  const DatasetSpec& spec_;
  std::uint64_t index_;
  std::string stem_;
  DatasetDraw draw_;
  Json parameters_;
  std::vector<std::string> started_;  // removed by the destructor
};

}  // namespace

std::optional<DatasetSample> find_sample(const DatasetSpec& spec, std::uint64_t index, const std::string& folder) {
  const std::string file = stem_of(index, folder) + ".json";
  const auto text = read_parameters(file);
  if (!text) return std::nullopt;
  try {
    const Json json = Json::parse(*text);
    if (json.at("lowlux") != version_number() || json.at("spec_sha256") != spec.sha256 || json.at("index") != index) {
      return std::nullopt;
    }
    for (const Json& part : json.at("files")) {
      std::error_code failed;
      const auto found = fs::file_size(fs::path(folder) / part.at("name").get<std::string>(), failed);
      if (failed || found != part.at("bytes").get<std::uint64_t>()) return std::nullopt;
      if (part.at("sha256").get<std::string>().size() != 64) return std::nullopt;
    }
    return sample_of(json.at("files"), fs::path(file).filename().string(), *text);
  } catch (const Json::exception&) {
    return std::nullopt;  // of another program, or damaged: the sample is made again
  }
}

Result<DatasetSample> make_sample(const DatasetSpec& spec, std::uint64_t index, const std::string& folder) {
  return SampleFiles(spec, index, folder).make();
}

}  // namespace lowlux::cli
