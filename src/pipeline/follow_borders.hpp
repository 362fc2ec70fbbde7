#pragma once

#include "pipeline/prepare_domain.hpp"

namespace hexopt {

/// Builds the domain anew with those smooth borders between faces of a CAD file as features beside which
/// cells fit (find_smooth_borders()); the sizes are those of an octree that is made for this. Nothing where
/// prepared.bordered is empty, which it is afterwards. The same input and options give the same domain, so
/// that a run that is resumed needs nothing else. Returns how many borders became features. Errors: those of
/// refine() and build_domain().
Result<std::size_t> follow_borders(PreparedDomain& prepared, const MeshOptions& options, StageClock& clock,
                                   Context& context);

} // namespace hexopt
