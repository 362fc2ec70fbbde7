#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

namespace hexopt {

enum class PerturbPattern {
    everywhere, ///< every inner vertex moves by a random fraction of its edges
    spots,      ///< clusters of vertices move a lot, the others not at all
};

struct PerturbOptions {
    double tangled_fraction = 0.1; ///< wanted cells with a non-positive one of the 32 tetrahedra; 0..0.9
    PerturbPattern pattern = PerturbPattern::everywhere;
    std::uint64_t seed = 1;
};

/// Cells with a non-positive (or NaN) one of their 32 tetrahedra (thesis 4.2.2).
std::size_t count_tangled(const HexMesh& mesh, const Parallel& parallel);

/// Moves inner vertices that do not hang until the wanted fraction of cells is tangled; hanging vertices
/// follow their masters, the boundary stays. Returns the fraction reached. Error (usage) where the wanted
/// fraction cannot be reached to within a tenth of it (and two cells), as on meshes with few inner vertices;
/// the mesh is unchanged then.
Result<double> perturb(HexMesh& mesh, const Topology& topology, const PerturbOptions& options,
                       const Parallel& parallel);

/// Puts every inner vertex that does not hang at a random place in the mesh's bounding box.
void scramble(HexMesh& mesh, const Topology& topology, std::uint64_t seed, const Parallel& parallel);

} // namespace hexopt
