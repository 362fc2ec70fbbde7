#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/topology.hpp"
#include "render/image.hpp"
#include "render/view.hpp"

#include <string>
#include <vector>

namespace hexopt {

enum class ColorBy {
    quality, ///< scaled Jacobian of each cell; concave or not certified cells stand out
    level,   ///< refinement level; needs HexMesh::level
    patch,   ///< patch of each boundary quad; needs HexMesh::boundary
    none,    ///< one colour for the boundary, one for what a cut uncovers
};

struct RenderOptions {
    PictureSize size;
    ColorBy color = ColorBy::quality;
    View view = make_view(-60, 30);
    std::vector<Clip> clips; ///< a cell is shown if all of them keep it
    /// Only the boundary faces of these patches, as surfaces seen from both sides; needs HexMesh::boundary.
    /// Empty: all.
    std::vector<std::string> patches;
    /// Leaves out boundary faces in the sides of the mesh's bounding box, such as the outer box of a flow;
    /// what is left are surfaces seen from both sides.
    bool without_box = false;
    std::size_t worst_count = 0; ///< 1..100: a close-up of each of the worst cells instead of the whole mesh
};

/// A shaded picture of the mesh's boundary, or of the cells that clips leave, with edges and a legend. Needs
/// no X server, no GPU. The same bits for any number of threads. Errors: usage (a colour that the mesh has no
/// data for, a patch that it has not, surfaces chosen for close-ups of cells, choices that leave nothing, no
/// cells), cancelled.
Result<Image> render_mesh(const HexMesh& mesh, const Topology& topology, const RenderOptions& options,
                          Context& context);

} // namespace hexopt
