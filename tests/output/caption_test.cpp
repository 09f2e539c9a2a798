#include <gtest/gtest.h>
#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "isp/output/dng/dng_writer.h"
#include "tests/support/raw_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

constexpr std::uint16_t image_description = 270;

/// Returns the ImageDescription of a DNG made of a frame whose source has this caption.
std::string description_of(const std::string& caption, const std::string& processing) {
  const test::ScratchDirectory scratch;
  RawFrame frame = test::plain_frame(24, 24);
  const auto* bytes = reinterpret_cast<const std::byte*>(caption.c_str());
  const auto count = static_cast<std::uint32_t>(caption.size() + 1);
  frame.source_tags = std::make_shared<const SourceTags>(
      SourceTags{.main = {{image_description, 2, count, {bytes, bytes + count}}}, .exif = {}, .gps = {}});
  EXPECT_TRUE(write_dng(frame, scratch.file("a.dng"), {.description = processing}));
  TIFF* const tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
  if (tiff == nullptr) return "no file";
  const char* text = nullptr;
  const std::string found = TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) == 1 ? text : "";
  TIFFClose(tiff);
  return found;
}

TEST(Caption, OfTheSourceIsFollowedByTheProcessing) {
  EXPECT_EQ(description_of("Perseids over the lake", "noise reduced"), "Perseids over the lake; noise reduced");
  const std::string accented = "caf\xC3\xA9";
  EXPECT_EQ(description_of(accented + "  ", "noise reduced"), accented + "; noise reduced");
}

TEST(Caption, OfTheSourceStaysAsItIsWithoutProcessingOrRoom) {
  EXPECT_EQ(description_of("a night", ""), "a night");
  const std::string long_caption(3990, 'x');
  EXPECT_EQ(description_of(long_caption, "noise reduced"), long_caption);
}

TEST(Caption, ThatIsBlankGivesWayToTheProcessing) {
  EXPECT_EQ(description_of("    ", "noise reduced"), "noise reduced");
  EXPECT_EQ(description_of("", "noise reduced"), "noise reduced");
}

}  // namespace
}  // namespace lowlux::isp
