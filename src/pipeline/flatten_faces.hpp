#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

namespace hexopt {

/// Down to which scaled Jacobian (-1..1) cells may become worse than they are.
struct FlattenOptions {
    double min_sj = 0.25;
    double last_min_sj = 0.2; ///< for faces that are warped still
};

struct FlattenReport {
    std::size_t warped_before = 0, warped_after = 0; ///< faces without a margin (FaceTets) of 2e-4
    std::size_t moved = 0;                           ///< vertices
    Point first_left = Point(0);                     ///< centre of the first of warped_after, model units
};

/// Moves vertices inside the mesh such that every face can be cut into triangles which span positive
/// tetrahedra with the centres of both its cells (FaceTets): warped faces are made flatter, or vertices of
/// their cells moved step by step. Cells stay usable and do not become worse than they were and than
/// FlattenOptions says; no other face becomes warped. The boundary stays. Errors: cancelled (the mesh is
/// sound), those of compute_polyhedral_faces().
Result<FlattenReport> flatten_faces(HexMesh& mesh, const Topology& topology, const FlattenOptions& options,
                                    Context& context);

} // namespace hexopt
