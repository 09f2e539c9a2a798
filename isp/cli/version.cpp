#include "isp/cli/version.h"

#include <fmt/format.h>

#include "capture/file/libraw_decoder.h"
#include "isp/raw/raw_to_rgb.h"

namespace lowlux::cli {

std::string version_number() { return LOWLUX_VERSION; }

std::string version_text() {
  return fmt::format("lowlux {}\nraw decoder: {}\nkernels: {}", version_number(), capture::decoder_name(),
                     isp::raw_to_rgb_target());
}

}  // namespace lowlux::cli
