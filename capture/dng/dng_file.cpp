#include "capture/dng/dng_file.h"

#include <algorithm>
#include <set>
#include <utility>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_directories = 64;
constexpr double max_offset = 9007199254740992.0;  // 2^53: doubles hold all integers up to here

bool is_full_raw(const TiffDirectory& directory) {
  const auto kind = directory.whole_or(tag::new_subfile_type, 0);
  const auto photometric = directory.whole_or(tag::photometric, 0);
  return kind && *kind == 0 && photometric &&
         (*photometric == tag::photometric_cfa || *photometric == tag::photometric_linear_raw);
}

double area_of(const TiffDirectory& directory) {
  const auto width = directory.whole_or(tag::image_width, 0), height = directory.whole_or(tag::image_length, 0);
  return width && height ? static_cast<double>(*width) * *height : 0.0;
}

/// Returns the offsets of the direct subdirectories of a directory, and of the one that follows it.
std::vector<std::uint64_t> neighbours(const TiffDirectory& directory) {
  std::vector<std::uint64_t> offsets;
  if (const auto below = directory.numbers(tag::sub_ifds, 1, max_directories); below && *below) {
    for (const double offset : **below) {
      if (offset > 0 && offset <= max_offset) offsets.push_back(static_cast<std::uint64_t>(offset));
    }
  }
  if (directory.next != 0) offsets.push_back(directory.next);
  return offsets;
}

/// Returns all directories, the first one first; damaged ones that are not needed otherwise are left out.
std::vector<TiffDirectory> all_directories(const TiffFile& tiff, TiffDirectory first) {
  std::vector<TiffDirectory> found;
  std::set<std::uint64_t> seen{tiff.first_directory()};
  std::vector<std::uint64_t> pending = neighbours(first);
  found.push_back(std::move(first));
  while (!pending.empty() && found.size() < max_directories) {
    const std::uint64_t offset = pending.front();
    pending.erase(pending.begin());
    if (!seen.insert(offset).second) continue;
    auto directory = tiff.directory(offset);
    if (!directory) continue;
    const auto more = neighbours(*directory);
    pending.insert(pending.end(), more.begin(), more.end());
    found.push_back(*std::move(directory));
  }
  return found;
}

Result<std::optional<TiffDirectory>> exif_of(const TiffFile& tiff, const TiffDirectory& main) {
  const auto offset = main.whole(tag::exif_ifd);
  if (!offset) return tl::make_unexpected(offset.error());
  if (!*offset) return std::nullopt;
  auto directory = tiff.directory(**offset);
  if (directory) return *std::move(directory);
  return fail(directory.error().code, std::string("the tag ") + tag::exif_ifd.name + ": " + directory.error().message);
}

/// Warns of a file that readers of the DNG versions known here may misread, as it states itself.
void warn_of_version(const TiffDirectory& main, std::vector<std::string>& warnings) {
  constexpr double known_major = 1, known_minor = 7;
  const auto version = main.numbers(tag::dng_backward_version, 4, 4);
  if (!version || !*version) return;
  const double major = (**version)[0], minor = (**version)[1];
  if (major < known_major || (major == known_major && minor <= known_minor)) return;
  warnings.push_back("the file requires a reader of DNG " + number_text(major) + "." + number_text(minor) +
                     ", lowlux knows 1.7: the image may be wrong");
}

}  // namespace

std::string ignored(const Error& error) { return error.message + "; the tag is ignored"; }

Result<std::optional<DngFile>> open_dng(std::span<const std::byte> bytes) {
  const auto tiff = TiffFile::open(bytes);
  if (!tiff) return std::nullopt;
  auto first = tiff->directory(tiff->first_directory());
  if (!first) return pass_on(first);
  if (first->find(tag::dng_version) == nullptr) return std::nullopt;

  DngFile dng;
  dng.main = *first;
  for (TiffDirectory& directory : all_directories(*tiff, *std::move(first))) {
    (is_full_raw(directory) ? dng.raw_images : dng.previews).push_back(std::move(directory));
  }
  if (dng.raw_images.empty())
    return fail(ErrorCode::unsupported, "this DNG contains no raw image, only rendered images");
  std::stable_sort(dng.raw_images.begin(), dng.raw_images.end(),
                   [](const auto& a, const auto& b) { return area_of(a) > area_of(b); });
  dng.exif = or_ignored(exif_of(*tiff, dng.main), dng.warnings);
  warn_of_version(dng.main, dng.warnings);
  return dng;
}

}  // namespace lowlux::capture
