#include "compute/host_packs.hpp"

#include "compute/kernel_args.hpp"

namespace hexopt::compute {

extern const NewtonPacks kNewtonPacks_baseline;
#ifdef HEXOPT_X86_KERNELS
extern const NewtonPacks kNewtonPacks_avx2;
extern const NewtonPacks kNewtonPacks_avx512;
#endif

namespace {

const NewtonPacks& widest_newton() {
#ifdef HEXOPT_X86_KERNELS
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return kNewtonPacks_avx512;
    if (__builtin_cpu_supports("avx2")) return kNewtonPacks_avx2;
#endif
    return kNewtonPacks_baseline;
}

} // namespace

PackFunction pack_function(const KernelInfo& kernel) {
    if (kernel.id == args::newton_vertex::kKernel) return widest_newton().vertex;
    if (kernel.id == args::newton_regular::kKernel) return widest_newton().regular;
    return nullptr;
}

} // namespace hexopt::compute
