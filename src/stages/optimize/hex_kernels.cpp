#include "stages/optimize/hex_kernels.hpp"

namespace hexopt {

extern const HexKernels kHexKernels_baseline;
#ifdef HEXOPT_X86_KERNELS
extern const HexKernels kHexKernels_avx2;
extern const HexKernels kHexKernels_avx512;
#endif

std::vector<const HexKernels*> available_hex_kernels() {
    std::vector<const HexKernels*> found;
#ifdef HEXOPT_X86_KERNELS
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        found.push_back(&kHexKernels_avx512);
    if (__builtin_cpu_supports("avx2")) found.push_back(&kHexKernels_avx2);
#endif
    found.push_back(&kHexKernels_baseline);
    return found;
}

const HexKernels& hex_kernels() {
    static const HexKernels* widest = available_hex_kernels().front();
    return *widest;
}

} // namespace hexopt
