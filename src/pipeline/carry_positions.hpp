#pragma once

#include "core/parallel.hpp"
#include "pipeline/entity_map.hpp"
#include "pipeline/mesh_attempt.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

/// Puts vertices of `now`, which is about to be optimized, where the optimizer put those of `earlier` that
/// started at the same place, bound to the same: all round them the two meshes are the same and nothing
/// failed. Returns, per cell, 1 where the earlier run's result stands for all of it and what is next to it;
/// empty: nowhere. now.topology must be known. entities: of the earlier domain in that of `now`.
std::vector<std::uint8_t> carry_positions(const MeshAttempt& earlier, const EntityMap& entities,
                                          MeshAttempt& now, const Parallel& parallel);

} // namespace hexopt
