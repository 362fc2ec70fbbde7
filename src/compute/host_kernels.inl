// Compiles every kernel for the host with one choice of `real` and `preal`: the including file defines
// HEXOPT_HOST_KERNELS (namespace), HEXOPT_HOST_FUNCTION and the types (kernels_f32.cpp and its siblings).
#include "compute/kernel_table.hpp"
#include "dialect/kernel_cpp.hpp"

namespace hexopt::compute::HEXOPT_HOST_KERNELS {

#include "dialect/kernel_types.inl"

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"

#include "math/sym3.glsl"

#include "math/corner_ball.glsl"

#include "dialect/kernel_hex.glsl"

#include "dialect/kernel_surface.glsl"

// The kernels' argument blocks.
#define KERNEL(name, ...) struct name {
#define COOPERATIVE(name, ...) KERNEL(name)
#define BUFFER(access, type, name) type name;
#define SCALAR(type, name) type name;
#define END                                                                                                  \
    uint count;                                                                                              \
    void run(uint gid) const;                                                                                \
    }                                                                                                        \
    ;
#include "kernels/kernels.def"

#include "kernel_bodies.inc" // generated: includes shaders/kernels/*.glsl and shaders/coop/*.glsl

template <class Kernel>
void run_range(const void* args, std::uint32_t begin, std::uint32_t end, const std::uint32_t* order) {
    const Kernel& kernel = *static_cast<const Kernel*>(args);
    for (std::uint32_t i = begin; i < end; ++i) kernel.run(order ? order[i] : i);
}

constexpr HostFunction kHostFunctions[] = {
#define KERNEL(name, ...) run_range<name>,
#define COOPERATIVE(name, ...) KERNEL(name)
#define BUFFER(access, type, name)
#define SCALAR(type, name)
#define END
#include "kernels/kernels.def"
};

} // namespace hexopt::compute::HEXOPT_HOST_KERNELS

namespace hexopt::compute {

HostFunction HEXOPT_HOST_FUNCTION(KernelId id) { return HEXOPT_HOST_KERNELS::kHostFunctions[id]; }

} // namespace hexopt::compute
