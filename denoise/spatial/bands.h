#pragma once

#include <algorithm>

#include "isp/base/executor.h"

namespace lowlux::denoise {

/// An executor, of which at most `threads` are used at once: there is scratch memory for that many.
struct Workers {
  Executor& executor;
  int threads;
};

/// Calls work(first, last, thread) for contiguous ranges of 0..count - 1, at most one range for each thread.
template <class Work>
void in_bands(const Workers& workers, int count, const Work& work) {
  const int parts = std::min({workers.executor.width(), workers.threads, std::max(1, count)});
  const auto edge = [&](int i) { return static_cast<int>(static_cast<long long>(count) * i / parts); };
  for_each_index(workers.executor, parts, [&](int index) { work(edge(index), edge(index + 1), index); });
}

}  // namespace lowlux::denoise
