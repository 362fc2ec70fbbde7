#include "core/parallel.hpp"

#include <atomic>
#include <optional>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

namespace hexopt {

struct Parallel::Arena {
    explicit Arena(int threads) : arena(threads) {
        // TBB has a worker less than the machine has cores unless told otherwise.
        if (threads > tbb::this_task_arena::max_concurrency())
            more_workers.emplace(tbb::global_control::max_allowed_parallelism,
                                 static_cast<std::size_t>(threads));
    }
    std::optional<tbb::global_control> more_workers;
    tbb::task_arena arena;
};

namespace {

#if defined(__SANITIZE_THREAD__)
// TBB is not built with the thread sanitizer, which therefore cannot see that a loop begins after what
// precedes it and ends before what follows. This says so, and orders nothing else: races between chunks are
// still found.
class LoopOrder {
  public:
    ~LoopOrder() { (void)ended_.load(std::memory_order_acquire); }
    void enter() { (void)begun_.load(std::memory_order_acquire); }
    void leave() { ended_.fetch_add(1, std::memory_order_release); }
    void begin() { begun_.store(1, std::memory_order_release); }

  private:
    std::atomic<int> begun_{0}, ended_{0};
};
#else
struct LoopOrder {
    void begin() {}
    void enter() {}
    void leave() {}
};
#endif

} // namespace

Parallel::Parallel(int threads)
    : threads_(threads > 0 ? threads : std::max(1, tbb::this_task_arena::max_concurrency())),
      arena_(threads_ > 1 ? std::make_unique<Arena>(threads_) : nullptr) {}

Parallel::~Parallel() = default;

void Parallel::for_chunks(std::size_t count, std::size_t chunk,
                          const std::function<void(std::size_t, std::size_t)>& body) const {
    const std::size_t chunks = (count + chunk - 1) / chunk;
    auto run = [&](std::size_t c) { body(c * chunk, std::min(count, (c + 1) * chunk)); };
    if (!arena_ || chunks <= 1) {
        for (std::size_t c = 0; c < chunks; ++c) run(c);
        return;
    }
    LoopOrder order;
    order.begin();
    arena_->arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks, 1), [&](const auto& range) {
            order.enter();
            for (std::size_t c = range.begin(); c < range.end(); ++c) run(c);
            order.leave();
        });
    });
}

} // namespace hexopt
