#include "isp/codec/tiff_output.h"

#include <tiffio.h>

#include <cerrno>

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

}  // namespace lowlux::isp
