#include "isp/base/executor.h"

#include <pthread.h>

#include <cassert>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace lowlux {

void InlineExecutor::run(int n, void (*fn)(void* context, int index), void* context) noexcept {
  for (int i = 0; i < n; ++i) fn(context, i);
}

// Task i runs on worker i mod width, task 0 on the caller: the same split every time, so per-task scratch stays warm.
struct PoolExecutor::State {
  std::mutex mutex;
  std::condition_variable work_ready;
  std::condition_variable work_done;
  std::vector<std::thread> workers;
  void (*fn)(void*, int) = nullptr;
  void* context = nullptr;
  int tasks = 0;
  int busy_workers = 0;
  unsigned generation = 0;
  bool stopping = false;

  void run_share(int worker, int n, void (*work)(void*, int), void* work_context) const {
    const int width = static_cast<int>(workers.size()) + 1;
    for (int i = worker; i < n; i += width) work(work_context, i);
  }

  void worker_loop(int worker) {
    unsigned seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      work_ready.wait(lock, [&] { return stopping || generation != seen; });
      if (stopping) return;
      seen = generation;
      lock.unlock();
      run_share(worker, tasks, fn, context);
      lock.lock();
      if (--busy_workers == 0) work_done.notify_one();
    }
  }
};

PoolExecutor::PoolExecutor(int threads) : state_(std::make_unique<State>()) {
  assert(threads >= 1);
  const std::lock_guard lock(state_->mutex);  // workers wait here until the list of them is whole
  try {
    for (int worker = 1; worker < threads; ++worker) {
      state_->workers.emplace_back([state = state_.get(), worker] { state->worker_loop(worker); });
      pthread_setname_np(state_->workers.back().native_handle(), "lowlux");
    }
  } catch (const std::system_error&) {
    // The system gives no more threads: those there are do the work.
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
  s.run_share(0, n, fn, context);
  std::unique_lock lock(s.mutex);
  s.work_done.wait(lock, [&] { return s.busy_workers == 0; });
}

}  // namespace lowlux
