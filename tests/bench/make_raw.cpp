// Makes a large raw file for timing: the active area of another, repeated to the size asked for, 14 bits, lossless
// JPEG.
//   make_raw IN.dng WIDTH HEIGHT OUT.dng
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "capture/file/dng_source.h"
#include "tests/support/dng_builder.h"

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: make_raw IN.dng WIDTH HEIGHT OUT.dng\n"), 2;
  const auto frame = lowlux::capture::read_raw(argv[1]);
  if (!frame) return std::fprintf(stderr, "make_raw: %s\n", frame.error().message.c_str()), 1;
  const lowlux::RawDn& raw = frame->raw;

  lowlux::test::DngBuilder dng;
  dng.width = std::atoi(argv[2]);
  dng.height = std::atoi(argv[3]);
  dng.bits = 14;
  dng.phase = raw.phase;
  dng.storage = lowlux::test::DngStorage::lossless_jpeg;
  dng.pixels.resize(static_cast<std::size_t>(dng.width) * dng.height);
  const int columns = raw.active.width & ~1, rows = raw.active.height & ~1;
  for (int y = 0; y < dng.height; ++y) {
    const std::uint16_t* source = raw.dn.row(raw.active.y + y % rows) + raw.active.x;
    for (int x = 0; x < dng.width; ++x) {
      dng.pixels[static_cast<std::size_t>(y) * dng.width + x] = source[x % columns] & 0x3fff;
    }
  }
  using lowlux::test::Tag;
  using lowlux::test::TagType;
  dng.set(50714, Tag::numbers(TagType::rational, {raw.black_tag ? raw.black_tag->at(0, 0) : 0.0}));  // BlackLevel
  dng.set(50717, Tag::numbers(TagType::u32, {raw.white_dn[1]}));                                     // WhiteLevel
  if (frame->colour.as_shot_neutral) {
    const lowlux::Vector3& n = *frame->colour.as_shot_neutral;
    dng.set(50728, Tag::numbers(TagType::rational, {n[0], n[1], n[2]}));  // AsShotNeutral
  }
  const std::vector<std::byte> file = dng.build();
  std::ofstream(argv[4], std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  return 0;
}
