#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace hexopt {

/// Parallel loops in chunks of fixed size. What a chunk is never depends on the number of threads, so results
/// that are combined in chunk order are the same bits for any thread count.
class Parallel {
  public:
    /// threads: 0 = all cores that the process may use.
    explicit Parallel(int threads = 0);
    ~Parallel();
    Parallel(const Parallel&) = delete;
    Parallel& operator=(const Parallel&) = delete;

    int threads() const { return threads_; }

    /// Calls body(begin, end) for [0,count) cut into chunks of `chunk` items, in any order, concurrently.
    void for_chunks(std::size_t count, std::size_t chunk,
                    const std::function<void(std::size_t begin, std::size_t end)>& body) const;

    /// Calls body(i) for every i of [0,count), `chunk` consecutive ones at a time.
    template <class Body>
    void for_each(std::size_t count, std::size_t chunk, const Body& body) const {
        for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) body(i);
        });
    }

    /// map(begin, end) -> T for every chunk; the results are combined in chunk order.
    template <class T, class Map, class Combine>
    T reduce(std::size_t count, std::size_t chunk, T initial, const Map& map, const Combine& combine) const {
        std::vector<T> partial((count + chunk - 1) / chunk, initial);
        for_chunks(count, chunk,
                   [&](std::size_t begin, std::size_t end) { partial[begin / chunk] = map(begin, end); });
        T total = initial;
        for (const T& part : partial) total = combine(total, part);
        return total;
    }

  private:
    struct Arena;
    int threads_;
    std::unique_ptr<Arena> arena_;
};

} // namespace hexopt
