#include "core/context.hpp"

#include <algorithm>

namespace hexopt {

void Context::log(LogLevel level, std::string_view message) const {
    if (log_) log_(level, message);
}

void Context::report(std::string_view stage, double fraction, std::string_view detail) {
    const double of_run = range_low_ + (range_high_ - range_low_) * std::clamp(fraction, 0.0, 1.0);
    fraction_ = std::clamp(of_run, fraction_, 1.0);
    if (progress_) progress_(stage, fraction_, detail);
}

} // namespace hexopt
