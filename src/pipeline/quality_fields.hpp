#pragma once

#include "core/parallel.hpp"
#include "io/mesh_io.hpp"

#include <filesystem>
#include <vector>

namespace hexopt {

/// Adds the quality of the mesh's cells to what is written to `output`, after arrays of the same names that
/// were read with it: `scaled_jacobian` (-1..1), `min_dihedral` (degrees, 0..180) and `valid` (1: no concave
/// tetrahedron of 32, and certified). Nothing where the format of that name holds no arrays.
void add_quality_fields(std::vector<FieldData>& fields, const std::filesystem::path& output,
                        const HexMesh& mesh, const Parallel& parallel);

} // namespace hexopt
