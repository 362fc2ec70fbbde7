#pragma once

#include <cstdint>

namespace hexopt {

/// Mixes the bits of a number (finaliser of SplitMix64, Steele, Lea, Flood 2014): a hash of integers.
constexpr std::uint64_t mix_bits(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// Sequence of random numbers that is the same on every platform: SplitMix64. `stream` separates sequences of
/// one seed, e.g. one a vertex, so that parallel loops draw the same numbers for any thread count.
class Random {
  public:
    explicit Random(std::uint64_t seed, std::uint64_t stream = 0)
        : state_(mix_bits(seed) ^ mix_bits(~stream)) {}

    std::uint64_t next() {
        state_ += 0x9e3779b97f4a7c15u;
        return mix_bits(state_);
    }
    /// Uniform in [0, 1).
    double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    /// Uniform in 0..count-1; count > 0 and far below 2^64.
    std::uint64_t below(std::uint64_t count) { return next() % count; }

  private:
    std::uint64_t state_;
};

} // namespace hexopt
