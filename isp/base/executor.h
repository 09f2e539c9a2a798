#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <type_traits>

namespace lowlux {

/// Runs n tasks, at most width() at a time. It allocates and throws nothing: tasks that may throw use for_each_index or
/// for_each_band.
class Executor {
 public:
  virtual ~Executor() = default;
  virtual int width() const noexcept = 0;
  /// Calls fn(context, i) for each i in 0..n-1 and returns when all are done. Not re-entrant.
  virtual void run(int n, void (*fn)(void* context, int index), void* context) noexcept = 0;
};

/// Runs every task on the calling thread.
class InlineExecutor final : public Executor {
 public:
  int width() const noexcept override { return 1; }
  void run(int n, void (*fn)(void* context, int index), void* context) noexcept override;
};

/// Runs tasks on the calling thread and on up to threads - 1 workers (as many as the system gives) named "lowlux".
/// Between calls the workers spin for a moment, then sleep; they end with the object.
class PoolExecutor final : public Executor {
 public:
  explicit PoolExecutor(int threads);
  ~PoolExecutor() override;
  PoolExecutor(const PoolExecutor&) = delete;
  PoolExecutor& operator=(const PoolExecutor&) = delete;

  int width() const noexcept override;
  void run(int n, void (*fn)(void* context, int index), void* context) noexcept override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Describes a contiguous range of rows, first included, last excluded.
struct RowBand {
  int first = 0;
  int last = 0;
};

/// Returns band `index` of `count` over `height` rows. Every band starts at an even row, so that the CFA phase is kept.
constexpr RowBand row_band(int height, int count, int index) {
  const int pairs = (height + 1) / 2;
  const auto edge = [&](int i) {
    const int row = 2 * static_cast<int>(static_cast<long long>(pairs) * i / count);
    return row < height ? row : height;
  };
  return {edge(index), edge(index + 1)};
}

/// Calls work(i) for each i in 0..count-1. The first exception that work throws is rethrown when all threads are done;
/// tasks that have not begun by then are skipped.
template <class Work>
void for_each_index(Executor& executor, int count, Work&& work) {
  struct Call {
    std::remove_reference_t<Work>* work;
    std::atomic<bool> failed{false};
    std::exception_ptr failure;
  } call{&work};
  const auto part = [](void* context, int index) {
    Call& c = *static_cast<Call*>(context);
    if (c.failed.load(std::memory_order_relaxed)) return;
    try {
      (*c.work)(index);
    } catch (...) {
      if (!c.failed.exchange(true)) c.failure = std::current_exception();
    }
  };
  executor.run(count, part, &call);
  if (call.failure) std::rethrow_exception(call.failure);
}

/// Calls work(band, index) for executor.width() bands of `height` rows.
template <class Work>
void for_each_band(Executor& executor, int height, const Work& work) {
  const int count = executor.width();
  for_each_index(executor, count, [&](int index) { work(row_band(height, count, index), index); });
}

}  // namespace lowlux
