#include "calib/noise/darktable_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calib/noise/json_scalars.h"
#include "calib/noise/sensor_class.h"
#include "isp/base/text.h"

namespace lowlux::calib {
namespace {

constexpr double furthest_iso_ratio = 8;        // beyond the entries of a camera
constexpr double extrapolation_exponent = 0.5;  // the uncertainty grows with the root of the ISO's ratio

/// Collects cameras from the events of the JSON.
class TableReader : public JsonReader {
 public:
  DarktableTable table;

  bool number(JsonPath path, double value) override {
    if (is_at(path, "noiseprofiles/[]/models/[]/profiles/[]/iso")) setting_.iso = value;
    if (is_at(path, "noiseprofiles/[]/models/[]/profiles/[]/a/[]")) put(value, a_count_++, setting_.a);
    if (is_at(path, "noiseprofiles/[]/models/[]/profiles/[]/b/[]")) put(value, b_count_++, setting_.b);
    return true;
  }

  bool text(JsonPath path, std::string_view value) override {
    if (is_at(path, "noiseprofiles/[]/maker")) maker_ = value.substr(0, max_name);
    if (is_at(path, "noiseprofiles/[]/models/[]/model")) camera_.model = value.substr(0, max_name);
    return true;
  }

  bool flag(JsonPath path, bool value) override {
    if (is_at(path, "noiseprofiles/[]/models/[]/profiles/[]/skip")) is_skipped_ = value;
    return true;
  }

  bool end_object(JsonPath path) override {
    if (is_at(path, "noiseprofiles/[]/models/[]/profiles/[]")) return end_setting();
    if (is_at(path, "noiseprofiles/[]/models/[]")) return end_camera();
    if (is_at(path, "noiseprofiles/[]")) end_maker();
    return true;
  }

 private:
  static constexpr std::size_t max_name = 64;

  /// Stores the figure of green, which is the second.
  static void put(double value, int index, double& out) {
    if (index == 1) out = value;
  }

  bool end_setting() {
    const bool is_noise = a_count_ == 3 && b_count_ == 3 && setting_.iso >= 1 && setting_.iso <= 1e8 &&
                          setting_.a > 1e-12 && setting_.a < 1 && std::abs(setting_.b) < 1;
    if (is_noise && !is_skipped_) {
      if (++settings_ > max_darktable_settings) return false;
      camera_.settings.push_back(setting_);
    }
    setting_ = {};
    a_count_ = b_count_ = 0;
    is_skipped_ = false;
    return true;
  }

  bool end_camera() {
    auto& settings = camera_.settings;
    std::ranges::stable_sort(settings, {}, &DarktableNoise::iso);
    const auto of_one_iso = [](const DarktableNoise& a, const DarktableNoise& b) { return a.iso == b.iso; };
    settings.erase(std::unique(settings.begin(), settings.end(), of_one_iso), settings.end());
    if (!settings.empty() && !camera_.model.empty()) {
      if (table.size() >= max_darktable_cameras) return false;
      table.push_back(std::move(camera_));
    }
    camera_ = {};
    return true;
  }

  void end_maker() {
    for (; named_ < table.size(); ++named_) table[named_].maker = maker_;
    maker_.clear();
  }

  std::string maker_;
  DarktableCamera camera_;
  DarktableNoise setting_;
  int a_count_ = 0, b_count_ = 0;
  bool is_skipped_ = false;
  std::size_t named_ = 0;  // cameras of the table with a maker
  std::size_t settings_ = 0;
};

/// Returns the letters and digits of a name, in lower case, and the asterisk of Pentax.
std::string key_of(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const char lower = ascii_lower(c);
    if ((lower >= 'a' && lower <= 'z') || (lower >= '0' && lower <= '9') || lower == '*') out += lower;
  }
  return out;
}

/// Canon's names of cameras in America and Japan, with those that tables use.
struct Region {
  std::string_view name, known_as;
};
constexpr std::array regions{
    Region{"eosdigitalrebelxt", "eos350d"},  Region{"eoskissdigitaln", "eos350d"},
    Region{"eosdigitalrebelxti", "eos400d"}, Region{"eoskissdigitalx", "eos400d"},
    Region{"eosdigitalrebelxsi", "eos450d"}, Region{"eoskissx2", "eos450d"},
    Region{"eosrebelt1i", "eos500d"},        Region{"eoskissx3", "eos500d"},
    Region{"eosrebelt2i", "eos550d"},        Region{"eoskissx4", "eos550d"},
    Region{"eosrebelt3i", "eos600d"},        Region{"eoskissx5", "eos600d"},
    Region{"eosrebelt4i", "eos650d"},        Region{"eoskissx6i", "eos650d"},
    Region{"eosrebelt5i", "eos700d"},        Region{"eoskissx7i", "eos700d"},
    Region{"eosrebelt6i", "eos750d"},        Region{"eoskissx8i", "eos750d"},
    Region{"eosrebelt7i", "eos800d"},        Region{"eoskissx9i", "eos800d"},
    Region{"eosrebelt3", "eos1100d"},        Region{"eoskissx50", "eos1100d"},
    Region{"eosrebelt5", "eos1200d"},        Region{"eoskissx70", "eos1200d"},
    Region{"eosrebelt6", "eos1300d"},        Region{"eoskissx80", "eos1300d"},
    Region{"eosrebelsl1", "eos100d"},        Region{"eoskissx7", "eos100d"},
    Region{"eosrebelsl2", "eos200d"},        Region{"eoskissx9", "eos200d"},
};

/// Returns the key of a model without its maker's name and without "Digital" at its end.
std::string model_key(std::string_view model, std::string_view maker_key) {
  std::string key = key_of(model);
  if (!maker_key.empty() && key.starts_with(maker_key) && key.size() > maker_key.size()) key.erase(0, maker_key.size());
  constexpr std::string_view digital = "digital";
  if (key.ends_with(digital) && key.size() > digital.size()) key.resize(key.size() - digital.size());
  const auto* const region = std::ranges::find(regions, std::string_view(key), &Region::name);
  return region == regions.end() ? key : std::string(region->known_as);
}

/// Returns whether a file's make and model are those of a maker in the table: "NIKON CORPORATION" of "Nikon", and
/// "RICOH IMAGING COMPANY, LTD.", "PENTAX K-1" of "Pentax".
bool is_made_by(std::string_view make_key, std::string_view model, std::string_view maker_key) {
  if (maker_key == "omsystem") return make_key.starts_with("om") || make_key.starts_with("olympus");
  return !maker_key.empty() &&
         (make_key.find(maker_key) != std::string_view::npos || key_of(model).starts_with(maker_key));
}

const DarktableCamera* camera_in(const DarktableTable& table, std::string_view make, std::string_view model) {
  const std::string make_key = key_of(make);
  const auto found = std::ranges::find_if(table, [&](const DarktableCamera& camera) {
    const std::string maker_key = key_of(camera.maker);
    return is_made_by(make_key, model, maker_key) && model_key(model, maker_key) == model_key(camera.model, maker_key);
  });
  return found == table.end() ? nullptr : &*found;
}

/// Returns b at a weight between two entries: by its logarithm where both are above 0, else linear.
double b_between(double low, double high, double weight) {
  if (low > 0 && high > 0) return std::exp(std::lerp(std::log(low), std::log(high), weight));
  return std::lerp(low, high, weight);
}

struct Found {
  DarktableNoise noise;
  double low_iso = 0, high_iso = 0;
  double beyond = 1;  // ratio of the ISO to the nearest entry, at least 1
};

Found noise_at(const std::vector<DarktableNoise>& settings, double iso) {
  const auto above = std::ranges::lower_bound(settings, iso, {}, &DarktableNoise::iso);
  if (above == settings.end() || above == settings.begin()) {
    const DarktableNoise& nearest = above == settings.end() ? settings.back() : settings.front();
    const double ratio = iso / nearest.iso;
    return {{iso, nearest.a * ratio, nearest.b * ratio * ratio}, nearest.iso, nearest.iso, std::max(ratio, 1 / ratio)};
  }
  const DarktableNoise &low = *(above - 1), &high = *above;
  if (high.iso == iso) return {high, iso, iso, 1};
  const double weight = std::log(iso / low.iso) / std::log(high.iso / low.iso);
  const double a = std::exp(std::lerp(std::log(low.a), std::log(high.a), weight));
  return {{iso, a, b_between(low.b, high.b, weight)}, low.iso, high.iso, 1};
}

}  // namespace

Result<DarktableTable> parse_darktable_noise(std::string_view json) {
  TableReader reader;
  if (const auto read = read_json(json, max_darktable_bytes, reader); !read) return tl::make_unexpected(read.error());
  if (reader.table.empty()) {
    return fail(ErrorCode::malformed,
                "the file has no camera with noise figures: it is not darktable's noiseprofiles.json");
  }
  return std::move(reader.table);
}

std::optional<DarktableMatch> find_darktable_noise(const DarktableTable& table, std::string_view make,
                                                   std::string_view model, double iso, double range_dn) {
  const DarktableCamera* const camera = camera_in(table, make, model);
  if (camera == nullptr || !(iso > 0) || !(range_dn > 0)) return std::nullopt;
  const Found found = noise_at(camera->settings, iso);
  if (!(found.beyond <= furthest_iso_ratio)) return std::nullopt;
  const double electrons = darktable_a_of_variance / found.noise.a;
  const double of_class = class_read_noise_e(electrons);
  const double of_table = electrons * std::sqrt(std::max(found.noise.b, 0.0) / darktable_a_of_variance);
  const double read_noise_e =
      of_table > 0 ? std::clamp(of_table, of_class / read_noise_factor, of_class * read_noise_factor) : of_class;
  const double gain_factor = darktable_gain_factor * std::pow(found.beyond, extrapolation_exponent);
  return DarktableMatch{.figures = {.gain_dn_per_e = range_dn / electrons,
                                    .read_noise_e = read_noise_e,
                                    .gain_factor = gain_factor,
                                    .read_noise_factor = read_noise_factor},
                        .camera = camera->maker + " " + camera->model,
                        .iso = iso,
                        .low_iso = found.low_iso,
                        .high_iso = found.high_iso,
                        .is_beyond = found.beyond > 1};
}

}  // namespace lowlux::calib
