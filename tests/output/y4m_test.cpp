#include "isp/output/picture/y4m.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <sstream>
#include <string>
#include <thread>

#include "isp/base/plane.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using isp::Y4mWriter;
using Written = isp::Y4mWriter::Written;

struct Picture420 {
  Plane<std::uint8_t> luma, chroma;
  Picture420(int width, int height) : luma(width, height), chroma(2 * ((width + 1) / 2), (height + 1) / 2) {}
};

Picture420 numbered(int width, int height, int seed) {
  Picture420 out(width, height);
  for (std::size_t i = 0; i < out.luma.size(); ++i) out.luma.data()[i] = static_cast<std::uint8_t>(7 * i + seed);
  for (std::size_t i = 0; i < out.chroma.size(); ++i)
    out.chroma.data()[i] = static_cast<std::uint8_t>(5 * i + seed + 1);
  return out;
}

/// What yuv4mpeg(5) says of a stream, read word by word.
struct Film {
  int width = 0, height = 0;
  std::string rate, tags;
  std::vector<std::string> frames;  // Y, then U, then V
};

Film read_film(const std::string& bytes) {
  Film film;
  std::istringstream in(bytes);
  std::string line, word;
  std::getline(in, line);
  std::istringstream header(line);
  header >> word;
  EXPECT_EQ(word, "YUV4MPEG2");
  while (header >> word) {
    if (word[0] == 'W') film.width = std::stoi(word.substr(1));
    if (word[0] == 'H') film.height = std::stoi(word.substr(1));
    if (word[0] == 'F') film.rate = word.substr(1);
    if (word[0] == 'C' || word[0] == 'X' || word[0] == 'I' || word[0] == 'A') film.tags += word + " ";
  }
  const int chroma = (film.width + 1) / 2 * ((film.height + 1) / 2);
  while (std::getline(in, line)) {
    EXPECT_EQ(line, "FRAME");
    std::string frame(static_cast<std::size_t>(film.width * film.height + 2 * chroma), '\0');
    in.read(frame.data(), static_cast<std::streamsize>(frame.size()));
    EXPECT_EQ(in.gcount(), static_cast<std::streamsize>(frame.size()));
    film.frames.push_back(frame);
  }
  return film;
}

class Y4m : public testing::Test {
 protected:
  Y4m() { std::signal(SIGPIPE, SIG_IGN); }

  std::string written(int width, int height, int frames) {
    const std::string name = scratch_.file("film.y4m");
    const int file = open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    Y4mWriter writer(file, {width, height, 25});
    for (int i = 0; i < frames; ++i) {
      const Picture420 picture = numbered(width, height, i);
      const auto done = writer.write(picture.luma.view(), picture.chroma.view(), stop_);
      EXPECT_TRUE(done && *done == Written::whole);
    }
    close(file);
    return scratch_.read("film.y4m");
  }

  test::ScratchDirectory scratch_;
  std::atomic<bool> stop_{false};
};

TEST_F(Y4m, HoldsEachFrameAsPlanesAfterOneHeader) {
  for (const auto& [width, height] : {std::pair{6, 4}, {5, 3}, {1, 1}, {2, 7}}) {
    const Film film = read_film(written(width, height, 3));
    EXPECT_EQ(film.width, width);
    EXPECT_EQ(film.height, height);
    EXPECT_EQ(film.rate, "25:1");
    EXPECT_EQ(film.tags, "Ip A1:1 C420jpeg XCOLORRANGE=LIMITED ");
    ASSERT_EQ(film.frames.size(), 3u);
    for (int i = 0; i < 3; ++i) {
      const Picture420 picture = numbered(width, height, i);
      const std::size_t luma = picture.luma.size(), chroma = picture.chroma.size() / 2;
      for (std::size_t k = 0; k < luma; ++k) {
        ASSERT_EQ(static_cast<std::uint8_t>(film.frames[i][k]), picture.luma.data()[k]) << k;
      }
      for (std::size_t k = 0; k < chroma; ++k) {
        ASSERT_EQ(static_cast<std::uint8_t>(film.frames[i][luma + k]), picture.chroma.data()[2 * k]) << k;
        ASSERT_EQ(static_cast<std::uint8_t>(film.frames[i][luma + chroma + k]), picture.chroma.data()[2 * k + 1]) << k;
      }
    }
  }
}

TEST_F(Y4m, RowsMayLieApart) {
  Picture420 wide = numbered(8, 4, 0);
  const std::string name = scratch_.file("crop.y4m");
  const int file = open(name.c_str(), O_WRONLY | O_CREAT, 0600);
  Y4mWriter writer(file, {4, 2, 30});
  ASSERT_TRUE(writer.write(wide.luma.view().crop(0, 0, 4, 2), wide.chroma.view().crop(0, 0, 4, 1), stop_));
  close(file);
  const Film film = read_film(scratch_.read("crop.y4m"));
  EXPECT_EQ(static_cast<std::uint8_t>(film.frames.at(0)[4]), wide.luma.at(0, 1));
}

TEST(Y4mHeader, RatesAreFractions) {
  const auto rate = [](double hz) {
    const std::string header = isp::y4m_header({2, 2, hz});
    const auto from = header.find(" F") + 2;
    return header.substr(from, header.find(' ', from) - from);
  };
  EXPECT_EQ(rate(30), "30:1");
  EXPECT_EQ(rate(30000.0 / 1001), "30000:1001");
  EXPECT_EQ(rate(29.97), "30000:1001");
  EXPECT_EQ(rate(59.94), "60000:1001");
  EXPECT_EQ(rate(12.5), "25:2");
  EXPECT_EQ(rate(0.2), "1:5");
  EXPECT_EQ(rate(0.001), "1:1000");
}

TEST_F(Y4m, SaysThatItsReaderLeft) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  close(ends[0]);
  Y4mWriter writer(ends[1], {64, 64, 30});
  const Picture420 picture = numbered(64, 64, 0);
  const auto done = writer.write(picture.luma.view(), picture.chroma.view(), stop_);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(*done, Written::reader_left);
  close(ends[1]);
}

TEST_F(Y4m, DoesNotWaitLongForAReaderThatTakesNothingOnceAskedToStop) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  Y4mWriter writer(ends[1], {512, 512, 30});  // more than a pipe holds
  const Picture420 picture = numbered(512, 512, 0);
  const auto start = std::chrono::steady_clock::now();
  std::jthread asker([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop_ = true;
  });
  const auto done = writer.write(picture.luma.view(), picture.chroma.view(), stop_);
  ASSERT_TRUE(done);
  EXPECT_EQ(*done, Written::interrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
  close(ends[0]);
  close(ends[1]);
}

TEST_F(Y4m, FinishesItsFrameForAReaderThatGoesOnReading) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  stop_ = true;
  std::string got;
  std::jthread reader([&] {
    std::array<char, 4096> piece{};
    for (ssize_t n = 0; (n = read(ends[0], piece.data(), piece.size())) > 0;) got.append(piece.data(), n);
  });
  const Picture420 picture = numbered(256, 256, 0);
  Y4mWriter writer(ends[1], {256, 256, 30});
  const auto done = writer.write(picture.luma.view(), picture.chroma.view(), stop_);
  close(ends[1]);
  reader.join();
  close(ends[0]);
  ASSERT_TRUE(done);
  EXPECT_EQ(*done, Written::whole);
  EXPECT_EQ(read_film(got).frames.size(), 1u);
}

TEST_F(Y4m, SaysThatADiskIsFull) {
  const int full = open("/dev/full", O_WRONLY);
  if (full < 0) GTEST_SKIP() << "no /dev/full";
  Y4mWriter writer(full, {4, 4, 30});
  const Picture420 picture = numbered(4, 4, 0);
  const auto done = writer.write(picture.luma.view(), picture.chroma.view(), stop_);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::unwritable);
  close(full);
}

}  // namespace
}  // namespace lowlux
