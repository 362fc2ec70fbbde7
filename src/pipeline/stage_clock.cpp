#include "pipeline/stage_clock.hpp"

#include <numeric>
#include <sys/resource.h>

namespace hexopt {

double StageClock::total_seconds() const {
    return std::accumulate(times_.begin(), times_.end(), 0.0,
                           [](double sum, const StageTime& time) { return sum + time.seconds; });
}

std::uint64_t StageClock::peak_memory_bytes() {
    rusage usage{};
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

} // namespace hexopt
