#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const PackFunction kNewtonPacks_baseline;
const PackFunction kNewtonPacks_baseline = baseline::newton_vertex;

} // namespace hexopt::compute
