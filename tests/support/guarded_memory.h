#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <span>
#include <stdexcept>

namespace lowlux::test {

/// Owns memory between two inaccessible pages: an access one byte too far ends the program.
class GuardedMemory {
 public:
  explicit GuardedMemory(std::size_t min_bytes) : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    size_ = (min_bytes + page_ - 1) / page_ * page_;
    void* const all = mmap(nullptr, size_ + 2 * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (all == MAP_FAILED) throw std::runtime_error("no memory for guarded pages");
    begin_ = static_cast<std::byte*>(all) + page_;
    if (mprotect(begin_, size_, PROT_READ | PROT_WRITE) != 0) throw std::runtime_error("pages cannot be guarded");
  }
  ~GuardedMemory() { munmap(begin_ - page_, size_ + 2 * page_); }
  GuardedMemory(const GuardedMemory&) = delete;
  GuardedMemory& operator=(const GuardedMemory&) = delete;

  /// Returns `bytes` of the memory: first() right after the page before, last() right before the page after.
  std::span<std::byte> first(std::size_t bytes) const { return {begin_, bytes}; }
  std::span<std::byte> last(std::size_t bytes) const { return {begin_ + (size_ - bytes), bytes}; }

 private:
  std::size_t page_ = 0;
  std::size_t size_ = 0;
  std::byte* begin_ = nullptr;
};

}  // namespace lowlux::test
