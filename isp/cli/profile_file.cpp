#include "isp/cli/profile_file.h"

#include <string_view>
#include <utility>

#include "calib/profile_io.h"
#include "capture/file/file_bytes.h"
#include "isp/output/report.h"

namespace lowlux::cli {

Result<CameraProfile> read_profile(const std::string& path) {
  const auto bytes = capture::read_file_bytes(path, calib::largest_profile_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  auto profile = calib::parse_profile(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  if (!profile) profile.error().where = path;  // the message has the key's path
  return profile;
}

Result<void> write_profile(const std::string& path, const CameraProfile& profile, isp::Overwrite overwrite) {
  const auto text = calib::profile_text(profile);
  if (!text) return fail(text.error().code, text.error().message, path);
  return isp::write_text(path, *text, overwrite);
}

}  // namespace lowlux::cli
