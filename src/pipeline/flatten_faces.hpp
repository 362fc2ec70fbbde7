#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <string>

namespace hexopt {

/// Down to which scaled Jacobian (-1..1) cells may become worse than they are.
struct FlattenOptions {
    double min_sj = 0.25;
    double last_min_sj = 0.2; ///< for faces that are warped still
    /// Where given, with the bindings of the mesh: vertices of the boundary may slide on patches and curves
    /// where moving others was not enough.
    const BoundaryModel* model = nullptr;
    /// Up to which distance from the surface quads may come by that, farther than they were; edges from their
    /// curves alike. Fraction of the surface's diagonal.
    double slack_rel = 5e-5;
};

struct FlattenReport {
    std::size_t warped_before = 0, warped_after = 0; ///< faces without a margin (FaceTets)
    std::size_t moved = 0;                           ///< times that a vertex was
    std::size_t slid = 0;                            ///< vertices of the boundary
    Point first_left = Point(0);                     ///< centre of the first of warped_after, model units
};

/// A sentence for the user on the faces that are left.
std::string describe_warped(const FlattenReport& report);

/// Moves vertices inside the mesh such that every face can be cut into triangles which span positive
/// tetrahedra with the centres of both its cells (FaceTets): warped faces are made flatter, or vertices of
/// their cells moved step by step. Cells stay usable and do not become worse than they were and than
/// FlattenOptions says; no other face becomes warped. The boundary stays but for what FlattenOptions::model
/// allows, and does not come to touch itself. Errors: cancelled (the mesh is
/// sound), those of compute_polyhedral_faces().
Result<FlattenReport> flatten_faces(HexMesh& mesh, const Topology& topology, const FlattenOptions& options,
                                    Context& context);

} // namespace hexopt
