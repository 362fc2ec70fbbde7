#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const PackFunction kNewtonPacks_avx2;
const PackFunction kNewtonPacks_avx2 = avx2::newton_vertex;

} // namespace hexopt::compute
