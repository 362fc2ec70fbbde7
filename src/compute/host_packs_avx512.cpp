#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const PackFunction kNewtonPacks_avx512;
const PackFunction kNewtonPacks_avx512 = avx512::newton_vertex;

} // namespace hexopt::compute
