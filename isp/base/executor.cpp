#include "isp/base/executor.h"

#include <pthread.h>

#include <atomic>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace lowlux {
namespace {

/// A waiting thread spins this long before it sleeps. The tasks of one frame follow each other sooner, and waking up
/// takes tens of microseconds.
constexpr std::chrono::microseconds busy_wait{50};

/// Yields the core to its other hardware thread for a moment.
void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Returns whether `done` became true before the time was up.
template <class Done>
bool waited_busily(const Done& done) {
  const auto end = std::chrono::steady_clock::now() + busy_wait;
  do {
    if (done()) return true;
    relax();
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

}  // namespace

void InlineExecutor::run(int n, void (*fn)(void* context, int index), void* context) noexcept {
  for (int i = 0; i < n; ++i) fn(context, i);
}

// Task i runs on worker i mod width, task 0 on the caller: always the same assignment, so per-task scratch stays in
// cache. A new generation signals new work; the work and the list of workers are written before it.
struct PoolExecutor::State {
  std::mutex mutex;
  std::condition_variable work_ready;
  std::condition_variable work_done;
  std::vector<std::thread> workers;
  void (*fn)(void*, int) = nullptr;
  void* context = nullptr;
  int tasks = 0;
  std::atomic<int> busy_workers = 0;
  std::atomic<unsigned> generation = 0;
  std::atomic<bool> stopping = false;

  void run_fraction(int worker, int n, void (*work)(void*, int), void* work_context) const {
    const int width = static_cast<int>(workers.size()) + 1;
    for (int i = worker; i < n; i += width) work(work_context, i);
  }

  template <class Done>
  void wait(std::condition_variable& told, const Done& done) {
    if (waited_busily(done)) return;
    std::unique_lock lock(mutex);
    told.wait(lock, done);
  }

  void worker_loop(int worker) {
    for (unsigned seen = 0;; ++seen) {
      wait(work_ready, [&] { return stopping || generation != seen; });
      if (stopping) return;
      run_fraction(worker, tasks, fn, context);
      if (--busy_workers == 0) {
        const std::lock_guard lock(mutex);
        work_done.notify_one();
      }
    }
  }
};

PoolExecutor::PoolExecutor(int threads) : state_(std::make_unique<State>()) {
  assert(threads >= 1);
  try {
    for (int worker = 1; worker < threads; ++worker) {
      state_->workers.emplace_back([state = state_.get(), worker] { state->worker_loop(worker); });
      pthread_setname_np(state_->workers.back().native_handle(), "lowlux");
    }
  } catch (const std::system_error&) {
    // The system gives no more threads: the existing ones do the work.
  }
}

PoolExecutor::~PoolExecutor() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->work_ready.notify_all();
  for (std::thread& worker : state_->workers) worker.join();
}

int PoolExecutor::width() const noexcept { return static_cast<int>(state_->workers.size()) + 1; }

void PoolExecutor::run(int n, void (*fn)(void* context, int index), void* context) noexcept {
  State& s = *state_;
  if (s.workers.empty() || n <= 1) {
    for (int i = 0; i < n; ++i) fn(context, i);
    return;
  }
  {
    const std::lock_guard lock(s.mutex);
    s.fn = fn;
    s.context = context;
    s.tasks = n;
    s.busy_workers = static_cast<int>(s.workers.size());
    ++s.generation;
  }
  s.work_ready.notify_all();
  s.run_fraction(0, n, fn, context);
  s.wait(s.work_done, [&] { return s.busy_workers == 0; });
}

}  // namespace lowlux
