#pragma once

#include "io/mesh_io.hpp"

namespace hexopt {

/// The folder that a mesh goes to when it is written under this name: a path that ends in "polyMesh" itself,
/// or constant/polyMesh beside a marker file NAME.foam, which ParaView opens; empty for any other name.
std::filesystem::path openfoam_folder(const std::filesystem::path& path);

/// Whether write_openfoam() may put its folder there: error output_failed where a file is in the way, or the
/// folder holds what is no part of a mesh.
Status check_openfoam_folder(const std::filesystem::path& path);

/// Writes a mesh as OpenFOAM's polyMesh: points, faces, owner, neighbour, boundary, and where the mesh has
/// levels cellLevel and pointLevel. Hanging vertices become corners of all faces beside them, so that the
/// mesh is one of conforming polyhedra; cells keep their order, faces come in upper triangular order. Patches
/// have the type `patch`, or `empty` where `empty_patches` has their name, and the mesh's names, with what
/// OpenFOAM takes for no part of a word replaced by
/// "_". Binary files have 32-bit labels and 64-bit scalars. The folder appears whole or not at all
/// (AtomicFolder). Errors: output_failed, bad_input (compute_polyhedral_faces), cancelled, out_of_memory.
Status write_openfoam(const std::filesystem::path& path, const HexMesh& mesh, Encoding encoding,
                      std::span<const std::string> empty_patches, Context& context);

} // namespace hexopt
