#include "compute/host_packs_impl.hpp"

namespace hexopt::compute {

extern const NewtonPacks kNewtonPacks_baseline;
const NewtonPacks kNewtonPacks_baseline = {baseline::newton_vertex, baseline::newton_regular};

} // namespace hexopt::compute
