#pragma once

#include "core/types.hpp"

#include <bit>
#include <cstdint>

namespace hexopt::io_detail {

/// Equal positions have equal hashes, -0 and 0 among them.
struct PointHash {
    std::size_t operator()(const Point& p) const {
        std::uint64_t hash = 0;
        for (int k = 0; k < 3; ++k) {
            hash = (hash ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) * 0x9E3779B97F4A7C15u; // -0 + 0 is 0
            hash ^= hash >> 29;
        }
        return hash;
    }
};

} // namespace hexopt::io_detail
