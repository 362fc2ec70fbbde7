#include "stages/optimize/hex_kernels_impl.hpp"

namespace hexopt {

extern const HexKernels kHexKernels_baseline;
const HexKernels kHexKernels_baseline = {"baseline", baseline::value, baseline::gradient, baseline::hessian,
                                         baseline::measure};

} // namespace hexopt
