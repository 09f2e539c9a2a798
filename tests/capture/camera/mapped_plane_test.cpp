#include "capture/libcamera/mapped_plane.h"

#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace lowlux::capture {
namespace {

/// A file in memory of `pages` pages, in place of a dma-buf: both are mapped and sized alike.
class Memory {
 public:
  explicit Memory(std::size_t pages) : fd_(memfd_create("lowlux", MFD_CLOEXEC)) {
    const auto page_bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    bytes_ = pages * page_bytes;
    std::string content(bytes_, '\0');
    for (std::size_t i = 0; i < bytes_; ++i) content[i] = static_cast<char>(i % 251);
    if (write(fd_, content.data(), bytes_) != static_cast<ssize_t>(bytes_)) ADD_FAILURE() << "memory is short";
  }
  ~Memory() { close(fd_); }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  int fd() const { return fd_; }
  std::size_t size() const { return bytes_; }

 private:
  int fd_;
  std::size_t bytes_ = 0;
};

TEST(MappedPlane, ShowsItsPartOfABufferThatOtherPlanesShare) {
  const Memory memory(3);
  // In the first page, across a page's end, and up to the last byte.
  for (const auto& [offset, length] :
       {std::pair<std::size_t, std::size_t>{0, 10}, {4000, 200}, {memory.size() - 7, 7}, {1, memory.size() - 1}}) {
    const auto plane = MappedPlane::map({.fd = memory.fd(), .offset = offset, .length = length});
    ASSERT_TRUE(plane) << plane.error().message;
    ASSERT_EQ(plane->bytes().size(), length);
    EXPECT_EQ(static_cast<std::size_t>(plane->bytes().front()), offset % 251);
    EXPECT_EQ(static_cast<std::size_t>(plane->bytes().back()), (offset + length - 1) % 251);
  }
}

TEST(MappedPlane, PlacesBehindTheBufferAreRefusedBeforeTheyAreTouched) {
  const Memory memory(1);
  constexpr std::size_t huge = std::numeric_limits<std::size_t>::max();
  for (const auto& [offset, length] : {std::pair<std::size_t, std::size_t>{0, memory.size() + 1},
                                       {memory.size(), 1},
                                       {0, 0},
                                       {huge, 2},
                                       {2, huge},
                                       {huge, huge}}) {
    const auto plane = MappedPlane::map({.fd = memory.fd(), .offset = offset, .length = length});
    ASSERT_FALSE(plane) << offset << " " << length;
    EXPECT_EQ(plane.error().code, ErrorCode::malformed);
  }
}

TEST(MappedPlane, WhatCannotBeMappedIsAnError) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  for (const int fd : {-1, pipe_ends[0]}) {
    const auto plane = MappedPlane::map({.fd = fd, .offset = 0, .length = 16});
    ASSERT_FALSE(plane);
    EXPECT_EQ(plane.error().code, ErrorCode::unreadable);
  }
  close(pipe_ends[0]);
  close(pipe_ends[1]);
}

TEST(MappedPlane, MemoryThatIsNoDmaBufNeedsNoSynchronising) {
  const Memory memory(1);
  const auto plane = MappedPlane::map({.fd = memory.fd(), .offset = 0, .length = 16});
  ASSERT_TRUE(plane) << plane.error().message;
  EXPECT_TRUE(plane->begin_reading());
  EXPECT_TRUE(plane->end_reading());
}

TEST(MappedPlane, AClosedBufferCannotBeSynchronised) {
  std::optional<Memory> memory(1);
  const auto plane = MappedPlane::map({.fd = memory->fd(), .offset = 0, .length = 16});
  ASSERT_TRUE(plane) << plane.error().message;
  memory.reset();
  EXPECT_FALSE(plane->begin_reading());
}

TEST(MappedPlane, MovesWithItsBytes) {
  const Memory memory(1);
  auto first = MappedPlane::map({.fd = memory.fd(), .offset = 3, .length = 16});
  auto second = MappedPlane::map({.fd = memory.fd(), .offset = 5, .length = 8});
  ASSERT_TRUE(first && second);
  const MappedPlane moved = std::move(*first);
  EXPECT_EQ(static_cast<int>(moved.bytes().front()), 3);
  *first = std::move(*second);
  EXPECT_EQ(static_cast<int>(first->bytes().front()), 5);
  EXPECT_EQ(first->bytes().size(), 8U);
}

}  // namespace
}  // namespace lowlux::capture
