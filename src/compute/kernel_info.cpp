#include "compute/kernel_info.hpp"

#include "compute/kernel_args.hpp"
#include "compute/kernel_table.hpp"

#include <array>
#include <type_traits>

namespace hexopt::compute {

namespace {

// Where the arguments of one kernel start in the list of all, in the order of kernels.def.
struct ArgRange {
    std::size_t begin, count;
};

enum class ArrayKind { IndexArray, RealArray, Vec3Array, PointArray };

constexpr ArrayType array_type(ArrayKind kind) { return static_cast<ArrayType>(kind); }

struct RawArg {
    bool opens_kernel; ///< first entry of every kernel, not an argument
    ArgInfo info;
};

constexpr RawArg kRawArgs[] = {
#define KERNEL(name, ...) {true, {#name, false, Access::none, ArrayType::index, 0}},
#define COOPERATIVE(name, ...) KERNEL(name)
#define BUFFER(access, type, name) {false, {#name, true, Access::access, array_type(ArrayKind::type), 0}},
#define SCALAR(type, name) {false, {#name, false, Access::read, ArrayType::index, 0}},
#define END {false, {"count", false, Access::read, ArrayType::index, 0}},
#include "kernels/kernels.def"
};

constexpr std::size_t kKernelCount = 0
#define KERNEL(name, ...) +1
#define COOPERATIVE(name, ...) +1
#define BUFFER(access, type, name)
#define SCALAR(type, name)
#define END
#include "kernels/kernels.def"
    ;

constexpr std::size_t kArgCount = std::size(kRawArgs) - kKernelCount;

struct Layout {
    std::array<ArgInfo, kArgCount> args{};
    std::array<ArgRange, kKernelCount> range{};
    std::array<std::uint32_t, kKernelCount> bytes{};
};

constexpr Layout compute_layout() {
    Layout layout{};
    std::size_t kernel = 0, arg = 0;
    std::uint32_t offset = 0;
    for (const RawArg& raw : kRawArgs) {
        if (raw.opens_kernel) {
            layout.range[kernel++] = {arg, 0};
            offset = 0;
            continue;
        }
        layout.args[arg] = raw.info;
        layout.args[arg++].offset = offset;
        offset += raw.info.is_buffer ? 8 : 4;
        ++layout.range[kernel - 1].count;
        layout.bytes[kernel - 1] = offset;
    }
    return layout;
}

constexpr Layout kLayout = compute_layout();

std::array<KernelInfo, kKernelCount> make_kernels() {
    std::array<KernelInfo, kKernelCount> list;
    KernelId id = 0;
    const auto add = [&](std::string_view name, bool cooperative, std::uint32_t local_size, double f32,
                         double f64) {
        const ArgRange range = kLayout.range[id];
        KernelInfo& info = list[id];
        info = {name, id, local_size, cooperative, f32, f64, {}, kLayout.bytes[id], {}, {}};
        info.args = std::span(kLayout.args).subspan(range.begin, range.count);
        for (int p = 0; p < kPrecisionCount; ++p) {
            info.host[p] = host_function(id, static_cast<Precision>(p));
            info.spirv[p] = spirv_blob(id, static_cast<Precision>(p));
        }
        ++id;
    };
#define KERNEL(name, local_size, f32, f64) add(#name, false, local_size, f32, f64);
#define COOPERATIVE(name, local_size, f32, f64) add(#name, true, local_size, f32, f64);
#define BUFFER(access, type, name)
#define SCALAR(type, name)
#define END
#include "kernels/kernels.def"
    return list;
}

} // namespace

std::span<const KernelInfo> kernels() {
    static const std::array<KernelInfo, kKernelCount> list = make_kernels();
    return list;
}

HostFunction host_function(KernelId id, Precision precision) {
    switch (precision) {
    case Precision::f32:
        return host_function_f32(id);
    case Precision::f64:
        return host_function_f64(id);
    case Precision::mixed:
        return host_function_mixed(id);
    }
    return nullptr;
}

const char* name_of(Precision precision) {
    constexpr const char* kNames[] = {"f32", "f64", "mixed"};
    return kNames[static_cast<int>(precision)];
}

std::size_t component_bytes(ArrayType type, Precision precision) {
    if (type == ArrayType::index) return 4;
    if (type == ArrayType::point) return precision == Precision::f32 ? 4 : 8;
    return precision == Precision::f64 ? 8 : 4;
}

std::size_t element_bytes(ArrayType type, Precision precision) {
    const bool is_vector = type == ArrayType::vec3 || type == ArrayType::point;
    return component_bytes(type, precision) * (is_vector ? 3 : 1);
}

} // namespace hexopt::compute
