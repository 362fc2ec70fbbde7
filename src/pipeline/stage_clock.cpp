#include "pipeline/stage_clock.hpp"

#include <ctime>
#include <numeric>
#include <sys/resource.h>

namespace hexopt {

double StageClock::total_seconds() const {
    return std::accumulate(times_.begin(), times_.end(), 0.0,
                           [](double sum, const StageTime& time) { return sum + time.seconds; });
}

double StageClock::process_cpu_seconds() {
    timespec time{};
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) != 0) return 0;
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::uint64_t StageClock::peak_memory_bytes() {
    rusage usage{};
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

} // namespace hexopt
