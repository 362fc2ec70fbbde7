#include "stages/optimize/hex_kernels_impl.hpp"

namespace hexopt {

extern const HexKernels kHexKernels_avx512;
const HexKernels kHexKernels_avx512 = {"avx512", avx512::value, avx512::gradient, avx512::hessian,
                                       avx512::measure};

} // namespace hexopt
