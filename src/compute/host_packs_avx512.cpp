#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const NewtonPacks kNewtonPacks_avx512;
const NewtonPacks kNewtonPacks_avx512 = {avx512::newton_vertex, avx512::newton_regular};

} // namespace hexopt::compute
