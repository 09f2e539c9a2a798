#include "capture/libcamera/completion_queue.h"

namespace lowlux::capture {

CompletionQueue::CompletionQueue(int buffers) { completions_.reserve(static_cast<std::size_t>(buffers)); }

void CompletionQueue::push(const Completion& completion) noexcept {
  const std::lock_guard lock(mutex_);
  if (completions_.size() == completions_.capacity()) return;
  completions_.push_back(completion);
  changed_.notify_all();
}

void CompletionQueue::set_disconnected() noexcept {
  const std::lock_guard lock(mutex_);
  gone_ = true;
  changed_.notify_all();
}

bool CompletionQueue::is_disconnected() const {
  const std::lock_guard lock(mutex_);
  return gone_;
}

std::optional<Completion> CompletionQueue::take(Time deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&] { return gone_ || !completions_.empty(); });
  if (completions_.empty()) return std::nullopt;
  const Completion oldest = completions_.front();
  completions_.erase(completions_.begin());
  return oldest;
}

bool CompletionQueue::wait_disconnected(Time deadline) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [&] { return gone_; });
}

void CompletionQueue::clear() {
  const std::lock_guard lock(mutex_);
  completions_.clear();
}

}  // namespace lowlux::capture
