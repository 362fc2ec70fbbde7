#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "io/project_on_cad.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <span>

namespace hexopt {

/// A CAD file that a surface was read from.
struct CadSource {
    std::filesystem::path path;
    std::uint64_t digest = 0; ///< of its bytes
    TessellationOptions tessellation;
};

/// What moving the boundary onto exact geometry did. Counts are of boundary vertices, lengths in model units.
struct CadReport {
    std::size_t vertices = 0; ///< bound to a patch, curve or corner
    std::size_t unmatched =
        0;                ///< of them, on what no CAD face, edge or vertex is (a farfield box, another file)
    std::size_t held = 0; ///< not moved all the way, for the cells or contacts there
    /// Distance of the others from their exact face, edge or vertex.
    double largest_before = 0, mean_before = 0, largest_after = 0, mean_after = 0;
};

/// Moves boundary vertices onto the exact face, edge or vertex that the triangles under them stand for (end
/// of thesis section 3.2), by a half, a quarter or an eighth of the way or not at all where cells would
/// become worse than they may: not usable, or below min_sj and below what they were; not at all also where
/// boundary quads would come to touch others. Vertices that were let
/// off the triangles (settle_mesh()) stay. `model` holds the bindings of the mesh. Errors: those of
/// project_on_cad().
Result<CadReport> move_onto_cad(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                std::span<const CadSource> sources, double min_sj, Context& context);

} // namespace hexopt
