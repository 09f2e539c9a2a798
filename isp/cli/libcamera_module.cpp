#include "isp/cli/libcamera_module.h"

#include "isp/cli/module.h"

namespace lowlux::cli {

Result<capture::LibcameraModule> load_libcamera() {
  const auto found = load_module({.file = "liblowlux_libcamera.so",
                                  .function = capture::libcamera_module_name,
                                  .purpose = "libcamera's cameras",
                                  .needs = "the libcamera it was built with (Debian: libcamera-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return *reinterpret_cast<capture::GetLibcameraModule*>(*found)();
}

}  // namespace lowlux::cli
