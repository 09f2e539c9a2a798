#pragma once

#include <algorithm>

#include "isp/base/executor.h"

namespace lowlux::denoise {

/// An executor, of which at most `threads` are used at once: there is scratch memory for so many.
struct Workers {
  Executor& executor;
  int threads;
};

/// Calls work(first, last, thread) for contiguous parts of 0..count - 1, at most one part for each thread.
template <class Work>
void in_bands(const Workers& workers, int count, const Work& work) {
  struct Call {
    const Work& work;
    long long count;
    int parts;
  } call{work, count, std::min({workers.executor.width(), workers.threads, std::max(1, count)})};
  workers.executor.run(
      call.parts,
      [](void* context, int index) {
        const Call& c = *static_cast<Call*>(context);
        const auto edge = [&c](int i) { return static_cast<int>(c.count * i / c.parts); };
        c.work(edge(index), edge(index + 1), index);
      },
      &call);
}

}  // namespace lowlux::denoise
