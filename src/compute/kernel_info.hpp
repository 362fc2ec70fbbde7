#pragma once

#include <cstdint>
#include <span>
#include <string_view>

/// What the host knows of each compute kernel; generated from shaders/kernels/kernels.def.
namespace hexopt::compute {

/// f32: everything in float. f64: everything in double. mixed: positions in double, differences of positions
/// taken in double and rounded, everything else in float.
enum class Precision : std::uint8_t { f32, f64, mixed };
inline constexpr int kPrecisionCount = 3;
const char* name_of(Precision precision);

enum class Access : std::uint8_t { none, read, write, read_write };

/// What a buffer argument is an array of; `real` and `point` change their width with the precision.
enum class ArrayType : std::uint8_t { index, real, vec3, point };

/// Bytes of one component (an index, a real or a coordinate).
std::size_t component_bytes(ArrayType type, Precision precision);
/// Bytes of one element: 3 components for vec3 and point.
std::size_t element_bytes(ArrayType type, Precision precision);

/// One argument of a kernel, at `offset` bytes in its argument block. Buffers take 8 bytes, scalars 4.
struct ArgInfo {
    std::string_view name;
    bool is_buffer;
    Access access;
    ArrayType type; ///< of buffers
    std::uint32_t offset;
};

using KernelId = std::uint16_t;

/// Runs invocations begin..end-1 of a kernel; `args` is its argument block with pointers in place of buffers;
/// `order` maps invocations to the work item that they do, null for the identity.
using HostFunction = void (*)(const void* args, std::uint32_t begin, std::uint32_t end,
                              const std::uint32_t* order);

/// SPIR-V words of one variant of a kernel.
using SpirvBlob = std::span<const std::uint32_t>;

struct KernelInfo {
    std::string_view name;
    KernelId id;
    std::uint32_t local_size;
    bool cooperative; ///< one work item is a whole workgroup, not one invocation
    double bound_f32; ///< largest difference to the CPU allowed on a real GPU, relative to the largest value
    double bound_f64; ///< written; 0 is required on lavapipe whatever stands here
    std::span<const ArgInfo> args;
    std::uint32_t args_bytes;
    HostFunction host[kPrecisionCount];
    SpirvBlob spirv[kPrecisionCount];
};

std::span<const KernelInfo> kernels();

} // namespace hexopt::compute
