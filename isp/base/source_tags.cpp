#include "isp/base/source_tags.h"

namespace lowlux {

std::size_t bytes_of(const SourceTags& tags) {
  std::size_t sum = 0;
  for (const auto* list : {&tags.main, &tags.exif, &tags.gps}) {
    for (const SourceTag& tag : *list) sum += tag.values.size();
  }
  return sum;
}

}  // namespace lowlux
