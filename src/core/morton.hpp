#pragma once

#include <cstdint>

namespace hexopt {

/// Bits of x (below 2^21), two zeros between each.
constexpr std::uint64_t spread_bits(std::uint64_t x) {
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

/// Place on the Z-order curve of a lattice point with coordinates below 2^21.
constexpr std::uint64_t morton_code(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

} // namespace hexopt
