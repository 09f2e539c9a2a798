#include "isp/base/source_tags.h"

#include <algorithm>
#include <string_view>

namespace lowlux {

std::size_t bytes_of(const SourceTags& tags) {
  std::size_t sum = 0;
  for (const auto* list : {&tags.main, &tags.exif, &tags.gps}) {
    for (const SourceTag& tag : *list) sum += tag.values.size();
  }
  return sum;
}

const SourceTag* find_tag(const std::vector<SourceTag>& tags, std::uint16_t id) {
  const auto found = std::ranges::find(tags, id, &SourceTag::id);
  return found == tags.end() ? nullptr : &*found;
}

std::string text_of(const std::vector<SourceTag>& tags, std::uint16_t id) {
  constexpr std::uint16_t ascii = 2;
  const SourceTag* tag = find_tag(tags, id);
  if (tag == nullptr || tag->type != ascii) return {};
  const std::string_view text(reinterpret_cast<const char*>(tag->values.data()), tag->values.size());
  return std::string(text.substr(0, text.find('\0')));
}

}  // namespace lowlux
