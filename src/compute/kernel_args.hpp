#pragma once

#include <cstddef>
#include <cstdint>

/// The argument block of each kernel as the host fills it in: the same layout as the kernel's own, with a
/// BufferRef where the kernel sees an address.
namespace hexopt::compute {

/// A place in a buffer: 8 bytes, like the address that takes its place.
struct BufferRef {
    std::uint32_t buffer = 0; ///< 0: none
    std::uint32_t offset = 0; ///< in units of 4 bytes
};

/// The smallest push constant block that Vulkan guarantees.
inline constexpr std::size_t kMaxArgsBytes = 128;

namespace detail {
enum KernelNumber : std::uint16_t {
#define KERNEL(name, ...) name##_number,
#define COOPERATIVE(name, ...) name##_number,
#define BUFFER(access, type, name)
#define SCALAR(type, name)
#define END
#include "kernels/kernels.def"
};
} // namespace detail

namespace args {

using uint = std::uint32_t;

#define KERNEL(name, ...)                                                                                    \
    struct name {                                                                                            \
        static constexpr std::uint16_t kKernel = detail::name##_number;
#define COOPERATIVE(name, ...) KERNEL(name)
#define BUFFER(access, type, name) BufferRef name;
#define SCALAR(type, name) type name;
#define END                                                                                                  \
    uint count = 0; /* work items */                                                                         \
    }                                                                                                        \
    ;
#include "kernels/kernels.def"

} // namespace args

} // namespace hexopt::compute
