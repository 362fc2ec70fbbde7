#include "stages/optimize/hex_kernels_impl.hpp"

namespace hexopt {

extern const HexKernels kHexKernels_avx2;
const HexKernels kHexKernels_avx2 = {"avx2", avx2::value, avx2::gradient, avx2::hessian, avx2::measure};

} // namespace hexopt
