#pragma once

#include "render/render_mesh.hpp"

namespace hexopt {

/// A sheet of close-ups: each of the worst cells solid, its neighbours as wires. Used by render_mesh().
Image render_worst_cells(const HexMesh& mesh, const Topology& topology, const RenderOptions& options,
                         Context& context);

} // namespace hexopt
