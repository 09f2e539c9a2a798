#include "capture/decoder/decoder_name.h"

#include <libraw/libraw_version.h>

namespace lowlux::capture {

std::string decoder_name() {
  return "LibRaw " + std::to_string(LIBRAW_MAJOR_VERSION) + "." + std::to_string(LIBRAW_MINOR_VERSION) + "." +
         std::to_string(LIBRAW_PATCH_VERSION);
}

}  // namespace lowlux::capture
