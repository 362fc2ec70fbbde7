#pragma once

#include "core/result.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>

namespace hexopt::bench {

/// Of the process, which runs one thread: others on the machine do not count.
inline double seconds_since(std::clock_t start) {
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// The value, or the end of the program with the error's line and exit code 3.
template <class T>
T must(Result<T> result) {
    if (result) return std::move(result).value();
    std::fprintf(stderr, "%s\n", result.error().one_line().c_str());
    std::exit(3);
}

} // namespace hexopt::bench
