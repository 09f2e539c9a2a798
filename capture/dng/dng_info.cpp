#include "capture/dng/dng_info.h"

#include <utility>

#include "capture/dng/dng_tags.h"

namespace lowlux::capture {
namespace {

constexpr double iso_not_told = 65535;  // EXIF 2.31: the sensitivity does not fit in 16 bits, see the other tags

std::optional<double> within(double value, double low, double high) {
  if (value >= low && value <= high) return value;
  return std::nullopt;
}

/// Returns the first value of an informative tag; nullopt if it is missing or damaged, which is not an error.
std::optional<double> first_number(const TiffDirectory& directory, TagName name) {
  const TiffEntry* entry = directory.find(name);
  if (entry == nullptr || entry->count == 0 || !entry->is_numeric()) return std::nullopt;
  return entry->number(0);
}

std::optional<double> iso_of(const TiffDirectory& exif) {
  const auto iso = first_number(exif, tag::iso);
  if (iso && *iso != iso_not_told) return plausible_iso(*iso);
  const auto index = first_number(exif, tag::recommended_exposure_index);
  return index ? plausible_iso(*index) : std::nullopt;
}

void read_exif(const TiffDirectory& exif, FrameInfo& info) {
  info.exposure_s = plausible_exposure_s(first_number(exif, tag::exposure_time).value_or(0));
  info.iso = iso_of(exif);
  info.f_number = plausible_f_number(first_number(exif, tag::f_number).value_or(0));
  info.focal_length_mm = plausible_focal_length_mm(first_number(exif, tag::focal_length).value_or(0));
  if (const auto celsius = first_number(exif, tag::ambient_temperature)) {
    info.temperature_c = plausible_temperature_c(*celsius);
  }
  info.date_time = plausible_date(exif.text(tag::date_time_original));
}

}  // namespace

std::optional<double> plausible_exposure_s(double seconds) { return within(seconds, 1e-7, 1e6); }
std::optional<double> plausible_iso(double iso) { return within(iso, 1, 1e8); }
std::optional<double> plausible_f_number(double f_number) { return within(f_number, 0.1, 1000); }
std::optional<double> plausible_focal_length_mm(double mm) { return within(mm, 0.1, 1e5); }
std::optional<double> plausible_temperature_c(double celsius) { return within(celsius, -200, 200); }

std::string plausible_date(const std::string& text) {
  constexpr char form[] = "0000:00:00 00:00:00";
  if (text.size() != sizeof form - 1 || text.compare(0, 4, "0000") == 0) return {};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (form[i] == '0' ? !digit : text[i] != form[i]) return {};
  }
  return text;
}

FrameInfo read_info(const DngFile& dng) {
  FrameInfo info;
  info.make = dng.main.text(tag::make);
  info.model = dng.main.text(tag::model);
  if (info.model.empty()) info.model = dng.main.text(tag::unique_camera_model);
  info.software = dng.main.text(tag::software);
  if (dng.exif) read_exif(*dng.exif, info);
  // TIFF/EP, which DNG builds upon, has the same tags in the first directory.
  if (!dng.exif) read_exif(dng.main, info);
  if (info.date_time.empty()) info.date_time = plausible_date(dng.main.text(tag::date_time));
  const double orientation = first_number(dng.main, tag::orientation).value_or(1);
  if (orientation >= 1 && orientation <= 8) info.orientation = static_cast<Orientation>(static_cast<int>(orientation));
  return info;
}

}  // namespace lowlux::capture
