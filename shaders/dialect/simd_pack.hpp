#pragma once

// A pack of floats or doubles on the compiler's vector extension. The namespace carries the instruction set's name,
// since translation units of different instruction sets are linked into one library.
#include "dialect/prelude.hpp"

#include <type_traits>

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>
#define HEXOPT_SIMD_NAMESPACE avx512
#define HEXOPT_SIMD_BYTES 64
#elif defined(__AVX2__)
#include <immintrin.h>
#define HEXOPT_SIMD_NAMESPACE avx2
#define HEXOPT_SIMD_BYTES 32
#else
#define HEXOPT_SIMD_NAMESPACE baseline
#define HEXOPT_SIMD_BYTES 16
#endif

namespace hexopt::dialect::HEXOPT_SIMD_NAMESPACE {

template <class T>
struct Pack {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    using SignedBits = std::make_signed_t<Bits>;
    typedef T Vector __attribute__((vector_size(HEXOPT_SIMD_BYTES)));
    typedef Bits BitVector __attribute__((vector_size(HEXOPT_SIMD_BYTES)));
    typedef SignedBits MaskVector __attribute__((vector_size(HEXOPT_SIMD_BYTES)));
    static constexpr int kLanes = HEXOPT_SIMD_BYTES / sizeof(T);

    struct Mask {
        MaskVector v;
    };

    Vector v;

    Pack() = default;
    Pack(Vector vector) : v(vector) {}
    template <class U>
        requires std::is_arithmetic_v<U>
    Pack(U scalar) : v(Vector{} + static_cast<T>(scalar)) {}

    T operator[](int lane) const { return v[lane]; }
    void set(int lane, T value) { v[lane] = value; }

    friend Pack operator+(Pack a, Pack b) { return {a.v + b.v}; }
    friend Pack operator-(Pack a, Pack b) { return {a.v - b.v}; }
    friend Pack operator*(Pack a, Pack b) { return {a.v * b.v}; }
    friend Pack operator/(Pack a, Pack b) { return {a.v / b.v}; }
    friend Pack operator-(Pack a) { return {-a.v}; }
    friend Mask operator<(Pack a, Pack b) { return {a.v < b.v}; }
    friend Mask operator>(Pack a, Pack b) { return {a.v > b.v}; }
    friend Mask operator==(Pack a, Pack b) { return {a.v == b.v}; }
    Pack& operator+=(Pack b) { return v += b.v, *this; }
    Pack& operator-=(Pack b) { return v -= b.v, *this; }

    friend Pack sel(Mask condition, Pack yes, Pack no) { return {condition.v ? yes.v : no.v}; }
    friend Pack min(Pack a, Pack b) { return {b.v < a.v ? b.v : a.v}; }
    friend Pack max(Pack a, Pack b) { return {a.v < b.v ? b.v : a.v}; }
    friend Pack abs(Pack a) { return {a.v < 0 ? -a.v : a.v}; }

    friend Pack sqrt(Pack a) {
#if HEXOPT_SIMD_BYTES == 64
        if constexpr (sizeof(T) == 4) return {(Vector)_mm512_sqrt_ps((__m512)a.v)};
        else return {(Vector)_mm512_sqrt_pd((__m512d)a.v)};
#elif HEXOPT_SIMD_BYTES == 32
        if constexpr (sizeof(T) == 4) return {(Vector)_mm256_sqrt_ps((__m256)a.v)};
        else return {(Vector)_mm256_sqrt_pd((__m256d)a.v)};
#else
        for (int lane = 0; lane < kLanes; ++lane) a.v[lane] = std::sqrt(a.v[lane]);
        return a;
#endif
    }

    friend Pack rcbrt_seed(Pack a) {
        const BitVector bits = (BitVector)a.v;
        if constexpr (sizeof(T) == 4) {
            return {(Vector)(0x54A2FA8Cu - bits / 3u)};
        } else {
            // n / 3 for n < 2^32 as a multiplication: the vector units have no integer division.
#if HEXOPT_SIMD_BYTES == 32
            const __m256i product = _mm256_mul_epu32((__m256i)(bits >> 32), _mm256_set1_epi64x(0xAAAAAAABll));
            const BitVector third = (BitVector)_mm256_srli_epi64(product, 33);
#else
            const BitVector third = ((bits >> 32) * 0xAAAAAAABull) >> 33;
#endif
            return {(Vector)(((0x553EF0FFull - third) & 0xFFFFFFFFull) << 32)};
        }
    }
};

} // namespace hexopt::dialect::HEXOPT_SIMD_NAMESPACE
