#pragma once

#include "io/mesh_io.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string_view>

namespace hexopt::io_detail {

/// Number types of binary files.
enum class Scalar : std::uint8_t {
    int8,
    uint8,
    int16,
    uint16,
    int32,
    uint32,
    int64,
    uint64,
    float32,
    float64
};

constexpr std::size_t size_of(Scalar scalar) {
    constexpr std::array<std::size_t, 10> kSize = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return kSize[static_cast<std::size_t>(scalar)];
}

constexpr bool is_integer(Scalar scalar) { return scalar != Scalar::float32 && scalar != Scalar::float64; }
constexpr bool is_integer(FieldType type) { return type != FieldType::float64 && type != FieldType::float32; }

/// The type that an array keeps when it is written again: the narrowest that holds every value.
constexpr FieldType field_type_of(Scalar scalar) {
    switch (scalar) {
    case Scalar::uint8:
        return FieldType::uint8;
    case Scalar::int8:
    case Scalar::int16:
    case Scalar::uint16:
    case Scalar::int32:
        return FieldType::int32;
    case Scalar::uint32:
    case Scalar::int64:
    case Scalar::uint64:
        return FieldType::int64;
    case Scalar::float32:
        return FieldType::float32;
    case Scalar::float64:
        break;
    }
    return FieldType::float64;
}

/// The number at `bytes`, which need not be aligned.
template <class T>
T load(const char* bytes, std::endian order) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes, sizeof(T));
    if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
}

/// Calls use(i, value) with each number of `bytes` in its own type. bytes.size() is a multiple of the size.
template <class Use>
void for_each_scalar(Scalar scalar, std::string_view bytes, std::endian order, const Use& use) {
    const auto run = [&]<class T>(T) {
        const std::size_t count = bytes.size() / sizeof(T);
        for (std::size_t i = 0; i < count; ++i) use(i, load<T>(bytes.data() + i * sizeof(T), order));
    };
    switch (scalar) {
    case Scalar::int8:
        return run(std::int8_t{});
    case Scalar::uint8:
        return run(std::uint8_t{});
    case Scalar::int16:
        return run(std::int16_t{});
    case Scalar::uint16:
        return run(std::uint16_t{});
    case Scalar::int32:
        return run(std::int32_t{});
    case Scalar::uint32:
        return run(std::uint32_t{});
    case Scalar::int64:
        return run(std::int64_t{});
    case Scalar::uint64:
        return run(std::uint64_t{});
    case Scalar::float32:
        return run(float{});
    case Scalar::float64:
        return run(double{});
    }
}

/// Integers beyond 53 bits are not exact as f64.
inline constexpr double kMostExactInteger = 9007199254740992.0;

} // namespace hexopt::io_detail
