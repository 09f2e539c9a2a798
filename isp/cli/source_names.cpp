#include "isp/cli/source_names.h"

namespace lowlux::cli {

std::string_view name_of(BlackPoint::Source source) {
  switch (source) {
    case BlackPoint::Source::masked_pixels:
      return "masked-pixels";
    case BlackPoint::Source::tag:
      return "tag";
    case BlackPoint::Source::given:
      return "given";
    case BlackPoint::Source::profile:
      return "profile";
    case BlackPoint::Source::dark_frame:
      return "dark-frame";
  }
  return "";
}

std::string_view name_of(NoiseProfile::Source source) {
  switch (source) {
    case NoiseProfile::Source::file:
      return "file";
    case NoiseProfile::Source::profile:
      return "profile";
    case NoiseProfile::Source::picture:
      return "picture";
  }
  return "";
}

}  // namespace lowlux::cli
