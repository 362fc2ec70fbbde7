#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const NewtonPacks kNewtonPacks_avx2;
const NewtonPacks kNewtonPacks_avx2 = {avx2::newton_vertex, avx2::newton_regular};

} // namespace hexopt::compute
