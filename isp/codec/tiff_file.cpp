#include "isp/codec/tiff_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include <tiffio.h>

#include "isp/codec/picture_file.h"

namespace lowlux::isp {
namespace {

/// Holds the caller's stream for libtiff. C requires a seek between reading and writing.
struct Output {
  std::FILE* file = nullptr;
  int write_errno = 0;
  TiffMessages messages;
};

Output* output_of(thandle_t handle) { return static_cast<Output*>(handle); }

tmsize_t read_file(thandle_t handle, void* data, tmsize_t size) {
  std::FILE* file = output_of(handle)->file;
  if (fseeko(file, 0, SEEK_CUR) != 0) return -1;
  const auto count = std::fread(data, 1, static_cast<std::size_t>(size), file);
  return fseeko(file, 0, SEEK_CUR) == 0 ? static_cast<tmsize_t>(count) : -1;
}

void keep_errno(Output& output) {
  if (output.write_errno == 0) output.write_errno = errno == 0 ? EIO : errno;
}

tmsize_t write_file(thandle_t handle, void* data, tmsize_t size) {
  errno = 0;
  const auto count = std::fwrite(data, 1, static_cast<std::size_t>(size), output_of(handle)->file);
  if (count != static_cast<std::size_t>(size)) keep_errno(*output_of(handle));
  return static_cast<tmsize_t>(count);
}

toff_t seek_file(thandle_t handle, toff_t offset, int whence) {
  errno = 0;
  std::FILE* file = output_of(handle)->file;
  if (fseeko(file, static_cast<off_t>(offset), whence) != 0) {  // it flushes first, and may fail on a full disk
    keep_errno(*output_of(handle));
    return static_cast<toff_t>(-1);
  }
  return static_cast<toff_t>(ftello(file));
}

toff_t size_of_file(thandle_t handle) {
  std::FILE* file = output_of(handle)->file;
  const off_t here = ftello(file);
  if (fseeko(file, 0, SEEK_END) != 0) return 0;
  const off_t size = ftello(file);
  return fseeko(file, here, SEEK_SET) == 0 ? static_cast<toff_t>(size) : 0;
}

int keep_open(thandle_t /*handle*/) { return 0; }

int keep_error(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format, va_list arguments) {
  static_cast<Output*>(user)->messages.keep(format, arguments);
  return 1;
}

int ignore_warning(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/, va_list /*list*/) {
  return 1;
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, CloseTiff>;

TiffHandle open_output(Output& output, bool big) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  if (options == nullptr) return nullptr;
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, &output);
  TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, nullptr);
  TIFF* tiff = TIFFClientOpenExt("picture", big ? "w8" : "w", &output, read_file, write_file, seek_file, keep_open,
                                 size_of_file, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  return TiffHandle(tiff);
}

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

struct TiffOutput::State {
  Output output;
  TiffHandle tiff;
};

TiffOutput::TiffOutput(std::FILE* file, bool big) : state_(std::make_unique<State>()) {
  state_->output.file = file;
  state_->tiff = open_output(state_->output, big);
}

TiffOutput::~TiffOutput() = default;

tiff* TiffOutput::handle() const { return state_->tiff.get(); }

Result<void> TiffOutput::finish(bool written) {
  const bool opened = state_->tiff != nullptr;
  state_->tiff.reset();
  const Output& output = state_->output;
  if (opened && written && output.write_errno == 0 && output.messages.first_error.empty()) return {};
  errno = output.write_errno;
  if (errno != 0) return write_failure();
  return fail(ErrorCode::unwritable, "libtiff: " + output.messages.first_error);
}

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
