#pragma once

#include "core/context.hpp"
#include "domain/domain.hpp"
#include "stages/fit/surface_mesh.hpp"

#include <vector>

namespace hexopt::fit {

struct FairingOptions {
    int taubin_steps = 10;    ///< double steps
    double lambda = 0.5;      ///< shrinking step, 0..1
    double mu = -0.53;        ///< growing step, < -lambda
    int projection_steps = 5; ///< half steps towards the surface
};

/// Outward unit normal at every vertex of the surface mesh, averaged by area.
std::vector<Point> vertex_normals(const SurfaceMesh& surface, const std::vector<Point>& positions);

/// Where hanging vertices of the surface lie, from their masters.
void place_hanging(const HexMesh& mesh, const SurfaceMesh& surface, std::vector<Point>& positions);

/// Positions (per local vertex) of the boundary after fairing and stepwise projection on the domain. A
/// projection counts only where the normals agree, or the shift is small (thesis 3.5, "snap-through").
/// Sources: Taubin 1995; thesis section 3.5.
std::vector<Point> fair_and_project(const HexMesh& mesh, const SurfaceMesh& surface, const Domain& domain,
                                    const FairingOptions& options, const Context& context);

} // namespace hexopt::fit
