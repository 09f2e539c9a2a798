#include "isp/codec/tiff_info.h"

#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

namespace lowlux::isp {
namespace {

constexpr double hottest_c = 200;  // above the temperature of any camera: a higher figure is rejected

void set_positive(TIFF* tiff, std::uint32_t tag, const std::optional<double>& number) {
  if (number && std::isfinite(*number) && *number > 0) TIFFSetField(tiff, tag, *number);
}

void set_text(TIFF* tiff, std::uint32_t tag, const std::string& text) {
  if (!text.empty()) TIFFSetField(tiff, tag, text.c_str());
}

/// Sets PhotographicSensitivity, which holds 16 bits; for larger figures EXIF 2.32 (4.6.6.7) requires 65535 and the
/// figure in another tag.
void set_sensitivity(TIFF* tiff, const std::optional<double>& iso) {
  if (!iso || !(*iso >= 1 && *iso < 4e9)) return;
  const auto exact = static_cast<std::uint32_t>(std::lround(*iso));
  const auto short_form = static_cast<std::uint16_t>(std::min<std::uint32_t>(exact, 65535));
  TIFFSetField(tiff, EXIFTAG_ISOSPEEDRATINGS, 1, &short_form);
  if (exact < 65535) return;
  TIFFSetField(tiff, EXIFTAG_SENSITIVITYTYPE, 2);  // recommended exposure index
  TIFFSetField(tiff, EXIFTAG_RECOMMENDEDEXPOSUREINDEX, exact);
}

/// Returns a number from libtiff, which returns some tags as float and some as double.
std::optional<double> number_of(TIFF* tiff, std::uint32_t tag) {
  const TIFFField* field = TIFFFindField(tiff, tag, TIFF_ANY);
  if (field == nullptr) return std::nullopt;
  double wide = 0;
  float narrow = 0;
  const bool is_wide = TIFFFieldSetGetSize(field) == sizeof(double);
  const bool found = is_wide ? TIFFGetField(tiff, tag, &wide) != 0 : TIFFGetField(tiff, tag, &narrow) != 0;
  const double number = is_wide ? wide : narrow;
  if (!found || !std::isfinite(number)) return std::nullopt;
  return number;
}

std::optional<double> positive(const std::optional<double>& number) {
  return number && *number > 0 ? number : std::nullopt;
}

std::string text_of(TIFF* tiff, std::uint32_t tag) {
  const char* text = nullptr;
  return TIFFGetField(tiff, tag, &text) != 0 && text != nullptr ? text : "";
}

std::optional<double> sensitivity_of(TIFF* tiff) {
  std::uint16_t count = 0;
  const std::uint16_t* list = nullptr;
  if (TIFFGetField(tiff, EXIFTAG_ISOSPEEDRATINGS, &count, &list) == 0 || count == 0 || list == nullptr) {
    return std::nullopt;
  }
  std::uint32_t exact = 0;
  if (list[0] == 65535 && TIFFGetField(tiff, EXIFTAG_RECOMMENDEDEXPOSUREINDEX, &exact) != 0) return exact;
  return list[0];
}

}  // namespace

void set_tiff_info(TIFF* file, const FrameInfo& info) {
  set_text(file, TIFFTAG_MAKE, info.make);
  set_text(file, TIFFTAG_MODEL, info.model);
  set_text(file, TIFFTAG_SOFTWARE, info.software);
  if (info.date_time.size() == 19) set_text(file, TIFFTAG_DATETIME, info.date_time);
  TIFFSetField(file, TIFFTAG_ORIENTATION, static_cast<int>(info.orientation));
}

std::uint64_t write_tiff_exif(TIFF* file, const FrameInfo& info) {
  if (TIFFCreateEXIFDirectory(file) != 0) return 0;
  TIFFSetField(file, EXIFTAG_EXIFVERSION, "0232");
  set_positive(file, EXIFTAG_EXPOSURETIME, info.exposure_s);
  set_positive(file, EXIFTAG_FNUMBER, info.f_number);
  set_positive(file, EXIFTAG_FOCALLENGTH, info.focal_length_mm);
  set_sensitivity(file, info.iso);
  if (info.temperature_c && std::fabs(*info.temperature_c) <= hottest_c) {
    TIFFSetField(file, EXIFTAG_TEMPERATURE, *info.temperature_c);
  }
  if (info.date_time.size() == 19) set_text(file, EXIFTAG_DATETIMEORIGINAL, info.date_time);
  std::uint64_t place = 0;
  const bool written = TIFFWriteCustomDirectory(file, &place) != 0;
  TIFFFreeDirectory(file);
  TIFFCreateDirectory(file);
  return written ? place : 0;
}

FrameInfo read_tiff_info(TIFF* file) {
  FrameInfo info;
  info.make = text_of(file, TIFFTAG_MAKE);
  info.model = text_of(file, TIFFTAG_MODEL);
  info.software = text_of(file, TIFFTAG_SOFTWARE);
  info.date_time = text_of(file, TIFFTAG_DATETIME);
  std::uint16_t orientation = 1;
  TIFFGetFieldDefaulted(file, TIFFTAG_ORIENTATION, &orientation);
  if (orientation >= 1 && orientation <= 8) info.orientation = static_cast<Orientation>(orientation);
  std::uint64_t exif = 0;
  if (TIFFGetField(file, TIFFTAG_EXIFIFD, &exif) == 0 || TIFFReadEXIFDirectory(file, exif) == 0) return info;
  info.exposure_s = positive(number_of(file, EXIFTAG_EXPOSURETIME));
  info.f_number = positive(number_of(file, EXIFTAG_FNUMBER));
  info.focal_length_mm = positive(number_of(file, EXIFTAG_FOCALLENGTH));
  info.temperature_c = number_of(file, EXIFTAG_TEMPERATURE);
  info.iso = sensitivity_of(file);
  if (auto taken = text_of(file, EXIFTAG_DATETIMEORIGINAL); !taken.empty()) info.date_time = std::move(taken);
  return info;
}

}  // namespace lowlux::isp
