#include "isp/cli/dataset/sample_arrays.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/synthetic/fixed_pattern.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::cli {
namespace {

/// Returns the name of a file of an array, like that of a file of the format DNG.
/// @param ending  ending of the latter
std::string array_name(const std::string& file, std::string_view ending, std::string_view array_ending) {
  assert(file.empty() || file.ends_with(ending));
  return file.empty() ? file : file.substr(0, file.size() - ending.size()).append(array_ending);
}

ArrayEntry raw_entry(const RawDn& raw) {
  return {"raw",
          raw.is_float() ? ElementType::f32 : ElementType::u16,
          {static_cast<std::size_t>(raw.rows()), static_cast<std::size_t>(raw.row_samples())}};
}

ArrayEntry picture_entry(const std::string& name, int width, int height) {
  return {name, ElementType::f32, {static_cast<std::size_t>(height), static_cast<std::size_t>(width), 3}};
}

}  // namespace

Plane<std::uint8_t> mask_of(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor) {
  const RawDn& raw = frame.raw;
  Plane<std::uint8_t> out(raw.row_samples(), raw.rows());
  const auto columns = static_cast<std::size_t>(out.width());
  const bool hot_simulated =
      args.options.effects.tolerance.has_value() || args.options.effects.effects.has(isp::Effect::hot_pixels);
  const double fraction = hot_simulated ? sensor.hot_pixel_fraction : 0;
  const double white_dn = std::round(raw.white_dn[0]);  // as the file states it
  std::vector<std::uint32_t> words(columns);
  std::vector<std::uint8_t> hot(columns);
  for (int y = 0; y < out.height(); ++y) {
    capture::find_hot_pixels({args.options.sensor_seed, 0, static_cast<std::uint32_t>(y)}, fraction, words, hot);
    for (int x = 0; x < out.width(); ++x) {
      const double code = raw.is_float() ? raw.dn_float.at(x, y) : raw.dn.at(x, y);
      unsigned mask = code >= white_dn ? mask_saturated : 0;
      if (hot[static_cast<std::size_t>(x)] != 0) mask |= mask_hot;
      if (x < args.options.masked_columns) mask |= mask_shielded;
      out.at(x, y) = static_cast<std::uint8_t>(mask);
    }
  }
  return out;
}

SampleArrays::SampleArrays(SampleFormat format, const SimulateFiles& files, const std::string& stem, bool masks)
    : format_(format), all_(stem + ".safetensors") {
  truth_ = array_name(files.truth, ".exr", ".npy");
  electrons_ = array_name(files.truth_electrons, ".exr", ".npy");
  for (const std::string& raw : files.frames) {
    raws_.push_back(array_name(raw, ".dng", ".raw.npy"));
    if (masks) masks_.push_back(array_name(raw, ".dng", ".mask.npy"));
  }
}

std::vector<std::string> SampleArrays::files() const {
  if (format_ == SampleFormat::safetensors) return {all_};
  std::vector<std::string> out;
  if (format_ == SampleFormat::npy) {
    out = raws_;
    for (const std::string& truth : {truth_, electrons_}) {
      if (!truth.empty()) out.push_back(truth);
    }
  }
  out.insert(out.end(), masks_.begin(), masks_.end());
  return out;
}

Result<void> SampleArrays::begin(const RawDn& raw, const std::map<std::string, std::string>& metadata) {
  if (format_ != SampleFormat::safetensors) return {};
  ArrayEntry frames = raw_entry(raw);
  if (raws_.size() > 1) frames.shape.insert(frames.shape.begin(), raws_.size());
  entries_ = {frames};
  if (!masks_.empty()) entries_.push_back({"mask", ElementType::u8, frames.shape});
  for (const auto& [name, file] : {std::pair("truth", truth_), std::pair("truth_electrons", electrons_)}) {
    if (!file.empty()) entries_.push_back(picture_entry(name, raw.active.width, raw.active.height));
  }
  auto file = ArrayFile::create_safetensors(all_, entries_, metadata);
  if (!file) return tl::make_unexpected(file.error());
  file_.emplace(*std::move(file));
  return {};
}

Result<void> SampleArrays::add_frame(const RawDn& raw, int index, const Plane<std::uint8_t>& mask) {
  const auto i = static_cast<std::size_t>(index);
  const ArrayEntry entry = raw_entry(raw);
  if (format_ != SampleFormat::dng) {
    const auto bytes =
        with_samples(raw, [&](const auto& dn) { return std::as_bytes(std::span(dn.data, raw.samples())); });
    if (auto done = put(entry, raws_[i], i, bytes); !done) return done;
  }
  if (masks_.empty()) return {};
  return put({"mask", ElementType::u8, entry.shape}, masks_[i], i, bytes_of(mask));
}

Result<void> SampleArrays::add_picture(const SceneLinear& picture, const std::string& name, const std::string& file) {
  const Plane<float> samples = interleaved(picture);
  return put(picture_entry(name, picture.width(), picture.height()), file, 0, bytes_of(samples));
}

Result<void> SampleArrays::finish() { return file_ ? file_->commit() : Result<void>(); }

Result<void> SampleArrays::put(const ArrayEntry& array, const std::string& file, std::size_t index,
                               std::span<const std::byte> bytes) {
  if (!file_) return write_npy(file, array, bytes);
  const auto entry = std::ranges::find(entries_, array.name, &ArrayEntry::name);
  assert(entry != entries_.end() && (index + 1) * bytes.size() <= bytes_of(*entry));
  return file_->put(static_cast<std::size_t>(entry - entries_.begin()), index * bytes.size(), bytes);
}

}  // namespace lowlux::cli
