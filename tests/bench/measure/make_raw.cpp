// Makes a large raw file for timing: the active area of another, repeated to the size asked for, 14 bits, lossless
// JPEG.
#include <fstream>
#include <string>

#include "capture/file/dng_source.h"
#include "tests/bench/measure/measure.h"
#include "tests/support/dng/dng_builder.h"

int lowlux::test::make_raw(Arguments& arguments) {
  const std::string in = arguments.required("IN.dng");
  DngBuilder dng;
  dng.width = Arguments::number_in(arguments.required("WIDTH"), 2);
  dng.height = Arguments::number_in(arguments.required("HEIGHT"), 2);
  const std::string out = arguments.required("OUT.dng");
  arguments.end();
  const RawFrame frame = value_of(capture::read_raw(in));
  const RawDn& raw = frame.raw;

  dng.bits = 14;
  dng.phase = raw.phase;
  dng.storage = DngStorage::lossless_jpeg;
  dng.pixels.resize(static_cast<std::size_t>(dng.width) * dng.height);
  const int columns = raw.active.width & ~1, rows = raw.active.height & ~1;
  for (int y = 0; y < dng.height; ++y) {
    const std::uint16_t* source = raw.dn.row(raw.active.y + y % rows) + raw.active.x;
    for (int x = 0; x < dng.width; ++x) {
      dng.pixels[static_cast<std::size_t>(y) * dng.width + x] = source[x % columns] & 0x3fff;
    }
  }
  dng.set(50714, Tag::numbers(TagType::rational, {raw.black_tag ? raw.black_tag->at(0, 0) : 0.0}));  // BlackLevel
  dng.set(50717, Tag::numbers(TagType::u32, {raw.white_dn[1]}));                                     // WhiteLevel
  if (frame.colour.as_shot_neutral) {
    const Vector3& n = *frame.colour.as_shot_neutral;
    dng.set(50728, Tag::numbers(TagType::rational, {n[0], n[1], n[2]}));  // AsShotNeutral
  }
  const std::vector<std::byte> file = dng.build();
  std::ofstream(out, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  return 0;
}
