#include "isp/cli/dataset/array_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using cli::ArrayEntry;
using cli::ArrayFile;
using cli::ElementType;

struct Drawn {
  ArrayEntry entry;
  std::string bytes;
};

/// Returns an array of up to three dimensions; many have sides of 1.
Drawn draw_array(std::mt19937& random, const std::string& name) {
  Drawn out{{name, static_cast<ElementType>(random() % 3), {}}, {}};
  const std::size_t dimensions = 1 + random() % 3;
  while (out.entry.shape.size() < dimensions) out.entry.shape.push_back(random() % 2 == 0 ? 1 : 1 + random() % 40);
  out.bytes.resize(cli::bytes_of(out.entry));
  std::generate(out.bytes.begin(), out.bytes.end(), [&] { return static_cast<char>(random() % 64); });  // no NaN
  return out;
}

std::span<const std::byte> part_of(const std::string& bytes, std::size_t from, std::size_t count) {
  return std::as_bytes(std::span(bytes)).subspan(from, count);
}

TEST(ArrayFile, NumpyReadsEveryShape) {
  if (test::run_process({"/usr/bin/python3", "-c", "import numpy"}).exit_code != 0)
    GTEST_SKIP() << "NumPy is not installed";
  const test::ScratchDirectory scratch;
  std::mt19937 random(29);
  std::vector<Drawn> all;
  for (int i = 0; i < 40; ++i) {
    all.push_back(draw_array(random, ""));
    ASSERT_TRUE(cli::write_npy(scratch.file(std::to_string(i)), all.back().entry,
                               part_of(all.back().bytes, 0, all.back().bytes.size())));
  }
  const auto read = test::run_process({"/usr/bin/python3", "-c",
                                       "import numpy, sys\n"
                                       "for i in range(40):\n"
                                       "    a = numpy.load(f'{sys.argv[1]}/{i}')\n"
                                       "    print(a.dtype.str, *a.shape)\n"
                                       "    a.tofile(f'{sys.argv[1]}/{i}.bytes')\n",
                                       scratch.file("")});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  std::string expected;
  for (std::size_t i = 0; i < all.size(); ++i) {
    expected += std::vector{"|u1", "<u2", "<f4"}[static_cast<std::size_t>(all[i].entry.type)];
    for (const std::size_t side : all[i].entry.shape) expected += " " + std::to_string(side);
    expected += "\n";
    EXPECT_EQ(scratch.read(std::to_string(i) + ".bytes"), all[i].bytes) << i;
    EXPECT_EQ((scratch.read(std::to_string(i)).size() - all[i].bytes.size()) % 64, 0u) << i;
  }
  EXPECT_EQ(read.out, expected);
}

TEST(ArrayFile, NamedArraysAreAlignedWithoutGapsWhateverTheOrderOfTheirParts) {
  const test::ScratchDirectory scratch;
  std::mt19937 random(30);
  for (int repeat = 0; repeat < 40; ++repeat) {
    std::vector<Drawn> all;
    std::vector<ArrayEntry> entries;
    entries.reserve(4);
    const std::string name = std::to_string(repeat);
    const std::size_t count = 1 + random() % 4;
    while (all.size() < count) all.push_back(draw_array(random, "array " + std::to_string(all.size())));
    for (const Drawn& drawn : all) entries.push_back(drawn.entry);
    const std::map<std::string, std::string> metadata{{"scene", std::string(random() % 20, 'x') + "\"\xc3\xa9\n"}};
    auto file = ArrayFile::create_safetensors(scratch.file(name), entries, metadata);
    ASSERT_TRUE(file);
    EXPECT_FALSE(scratch.holds(name));
    for (std::size_t i = all.size(); i-- > 0;) {
      const std::string& bytes = all[i].bytes;
      const std::size_t cut = random() % bytes.size();
      ASSERT_TRUE(file->put(i, cut, part_of(bytes, cut, bytes.size() - cut)));
      ASSERT_TRUE(file->put(i, 0, part_of(bytes, 0, cut)));
    }
    ASSERT_TRUE(file->commit());

    const std::string text = scratch.read(name);
    std::size_t header = 0;
    for (int i = 7; i >= 0; --i) header = header << 8 | static_cast<unsigned char>(text[static_cast<std::size_t>(i)]);
    EXPECT_EQ(header % 8, 0u);
    const auto json = nlohmann::json::parse(text.substr(8, header));
    EXPECT_EQ(json.size(), all.size() + 1);
    EXPECT_EQ(json["__metadata__"], nlohmann::json(metadata));
    std::map<std::size_t, std::size_t> ends;
    for (const Drawn& drawn : all) {
      const auto& entry = json[drawn.entry.name];
      const std::size_t begin = entry["data_offsets"][0], end = entry["data_offsets"][1];
      const auto type = static_cast<std::size_t>(drawn.entry.type);
      EXPECT_EQ(entry["dtype"], (std::vector{"U8", "U16", "F32"}[type]));
      EXPECT_EQ(entry["shape"], drawn.entry.shape);
      EXPECT_EQ(begin % (std::size_t{1} << type), 0u);
      EXPECT_EQ(text.substr(8 + header + begin, end - begin), drawn.bytes);
      ends[begin] = end;
    }
    std::size_t at = 0;
    for (const auto& [begin, end] : ends) {
      EXPECT_EQ(begin, at);
      at = end;
    }
    EXPECT_EQ(8 + header + at, text.size());
  }
}

}  // namespace
}  // namespace lowlux
