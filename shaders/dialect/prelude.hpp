#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

/// What the shared mathematics of shaders/math needs in C++: a three-vector over any real type (float, double
/// or a SIMD pack, which GLM's functions refuse) and GLSL's words for parameters.
#define FN inline
#define OUT(T) T&
#define INOUT(T) T&

namespace hexopt::dialect {

template <class T>
struct Vec3 {
    T x, y, z;
    Vec3() = default;
    Vec3(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
    // A defaulted copy is moved through memory 16 bytes at a time; the wider loads that follow then wait for
    // it.
    Vec3(const Vec3& other) : x(other.x), y(other.y), z(other.z) {}
    Vec3& operator=(const Vec3& other) {
        x = other.x, y = other.y, z = other.z;
        return *this;
    }
};

template <class T>
inline Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
inline Vec3<T> operator*(const Vec3<T>& a, const T& s) {
    return {a.x * s, a.y * s, a.z * s};
}
template <class T>
inline Vec3<T> operator*(const T& s, const Vec3<T>& a) {
    return {a.x * s, a.y * s, a.z * s};
}
template <class T>
inline Vec3<T> operator-(const Vec3<T>& a) {
    return {-a.x, -a.y, -a.z};
}
template <class T>
inline T dot(const Vec3<T>& a, const Vec3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
inline Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}

template <class T>
inline T divide(const T& a, const T& b) {
    return a / b;
}

inline float rcbrt_seed(float x) {
    return std::bit_cast<float>(0x54A2FA8Cu - std::bit_cast<std::uint32_t>(x) / 3u);
}
inline double rcbrt_seed(double x) {
    const auto high = static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x) >> 32);
    return std::bit_cast<double>(static_cast<std::uint64_t>(0x553EF0FFu - high / 3u) << 32);
}

} // namespace hexopt::dialect
