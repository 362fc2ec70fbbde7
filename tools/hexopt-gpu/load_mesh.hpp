#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/topology.hpp"

#include <filesystem>

namespace hexopt::cli {

struct LoadedMesh {
    HexMesh mesh;
    Topology topology;
};

/// Reads a mesh, recognises hanging vertices where the file does not name any, and derives the topology.
Result<LoadedMesh> load_mesh(const std::filesystem::path& path, Context& context);

} // namespace hexopt::cli
