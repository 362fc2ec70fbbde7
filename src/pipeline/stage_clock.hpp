#pragma once

#include <chrono>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

namespace hexopt {

struct StageTime {
    std::string stage;
    double seconds;                  ///< wall clock
    double cpu_seconds;              ///< of all threads of the process
    std::uint64_t peak_memory_bytes; ///< of the process, up to the end of the stage; 0 where unknown
};

/// Measures the stages of a run, one after another.
class StageClock {
  public:
    /// Runs body() as the stage `name` and returns what it returns.
    template <class Body>
    auto run(std::string name, const Body& body) {
        const auto start = std::chrono::steady_clock::now();
        const double cpu_start = process_cpu_seconds();
        auto result = body();
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
        times_.push_back(
            {std::move(name), elapsed.count(), process_cpu_seconds() - cpu_start, peak_memory_bytes()});
        return result;
    }

    /// Puts the stages of an earlier part of the run before those measured.
    void add_earlier(std::vector<StageTime> times) {
        times_.insert(times_.begin(), std::make_move_iterator(times.begin()),
                      std::make_move_iterator(times.end()));
    }

    const std::vector<StageTime>& times() const { return times_; }
    double total_seconds() const;

    /// Largest resident size of this process so far; 0 where the system does not tell.
    static std::uint64_t peak_memory_bytes();
    /// Processor time of this process so far, all threads; 0 where the system does not tell.
    static double process_cpu_seconds();

  private:
    std::vector<StageTime> times_;
};

} // namespace hexopt
