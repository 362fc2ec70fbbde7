#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/surface_queries.hpp"
#include "mesh/hex_mesh.hpp"
#include "stages/trim/surface_sides.hpp"

#include <memory>
#include <vector>

namespace hexopt {

/// Of thicker walls, in cells, the centres of enough cells are inside.
constexpr double kThickestWall_h = 1.8;

enum class TrimRule : std::uint8_t {
    centre, ///< keep a cell whose centre is inside by `depth_h`
    strict, ///< keep a cell that the surface neither cuts nor excludes (thesis 3.4)
};

/// What happens where a large face or edge would be half on the surface and half inside.
enum class PartialFaces : std::uint8_t {
    refine, ///< named in TrimOutput::refine_cells
    remove, ///< cells there are removed, so that the mesh can be used as it is
};

struct TrimOptions {
    TrimRule rule = TrimRule::centre;
    double depth_h = 0.1; ///< how far inside, in cell sizes (shortest direction of the cell); 0..0.5
    /// Points in what is to be meshed, model units; each keeps the part that it is in. Empty: all parts of at
    /// least part_fraction of the largest one's volume. A seed in a region that the surface encloses from
    /// its other side (body turned inside out) selects that side.
    std::vector<Point> seeds;
    double part_fraction = 0.01; ///< 0..1; 1 keeps the largest part alone
    PartialFaces partial = PartialFaces::refine;
    /// A layer one cell thick is named whole in refine_cells where cells in it or at its border are.
    bool whole_layers = false;
    /// Where the surface would be left bare, cells are kept that the middle of a wall goes through which is
    /// at least so thick, in cells; 0: none. Not with seeds or the strict rule. 0..1
    double thinnest_wall_h = 0.25;
    /// Whether faults of the surface left are counted; see count_faults().
    bool count_faults = true;
};

/// A place of the surface that no kept cell is near.
struct BareSpot {
    Point at;
    Index cell;       ///< of the octree
    Index patch;      ///< of the domain
    double area;      ///< of the surface there, within one cell; model units squared
    double cell_size; ///< of the octree cell there, model units
    double
        thickness; ///< of what is to be meshed behind the surface in the cell, at most 4 cells; model units
    Index part;    ///< in TrimOutput::bare_parts
};

/// Bare spots whose cells touch.
struct BarePart {
    double area = 0; ///< model units squared
    /// Most cells between one and the kept ones, from cell to touching cell; where none touches a kept one,
    /// from the first.
    Index depth = 0;
};

/// Counts of cells unless said otherwise.
struct TrimReport {
    std::size_t octree_cells = 0, kept_cells = 0;
    std::size_t cut_cells = 0;        ///< touched by the surface
    std::size_t uncertain_cells = 0;  ///< away from the surface but asked one by one: its holes let through
    std::size_t gap_removed = 0;      ///< beside a neighbour on the other side of a gap
    std::size_t manifold_removed = 0; ///< where the surface touched itself
    std::size_t tips_removed = 0;     ///< with five faces on the surface
    std::size_t pits_filled = 0;      ///< with five faces towards kept cells
    std::size_t partial_filled = 0;   ///< hardly outside, behind half faces and round half edges
    std::size_t partial_removed = 0;  ///< PartialFaces::remove
    std::size_t wall_cells = 0;       ///< in the middle of walls that would have been left bare
    std::size_t parts = 0;            ///< kept; more than the surface has bodies where thin walls were lost
    std::size_t parts_dropped = 0, part_cells_dropped = 0;
    double kept_volume = 0;        ///< of the kept cells, model units cubed
    double enclosed_volume = 0;    ///< of the surface, overlaps counted twice; 0 where it is not closed
    double surface_area = 0;       ///< inside the octree, model units squared
    double bare_area = 0;          ///< of it, has no kept cell near it; 0 where seeds are given
    Point first_bare = Point(0);   ///< a place there
    std::size_t half_faces = 0;    ///< faces, in the mesh as it is left
    std::size_t half_edges = 0;    ///< edges, in the mesh as it is left
    std::size_t surface_quads = 0; ///< faces of the surface left; as the next ones by count_faults()
    /// Of the surface left, hanging vertices inserted; all 0 where it is a closed manifold, which it is
    /// where nothing is to be refined.
    std::size_t open_edges = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0;
    bool closed_manifold() const { return open_edges + nonmanifold_edges + nonmanifold_vertices == 0; }
};

struct TrimOutput {
    HexMesh kept;                     ///< cells and vertices in the octree's order; no boundary patches
    std::vector<Index> kept_cell;     ///< per kept cell: its number in the octree
    std::vector<Index> refine_cells;  ///< cells of the octree that must be refined first; rising
    std::vector<Index> bare_cells;    ///< cells of the octree in which the surface is bare; rising
    std::vector<BareSpot> bare_spots; ///< by rising cell; one a direction in which the surface faces there
    std::vector<BarePart> bare_parts;
    TrimReport report;
};

/// What is known of cells from earlier trims of the same octree, so that only new cells are looked at.
class TrimMemory {
  public:
    /// Key of each cell of the octree that is trimmed next: stays with a cell while it is not split. The
    /// memory is for one domain and one choice of seeds. None: nothing is trimmed for a while.
    void set_keys(std::vector<Index> keys);
    std::span<const Index> keys() const { return keys_; }

    struct Side {
        bool known = false; ///< whether the surface cuts the cell, and where it does also the rest
        bool cut = false;
        bool side_known = false; ///< `inside` where the surface does not cut the cell
        bool inside = false;
        float depth_h = -1;
    };
    Side& side(Index cell) { return side_[keys_[cell]]; }
    /// Of the domain's surface, its outward side; made once.
    SurfaceQueries& queries(const BoundaryModel& model);
    trimming::SurfaceSides& surface() { return surface_; }
    /// Forgets what takes most of the room: where the surface is in the cells that it cuts.
    void forget_surface() { surface_ = {}; }

  private:
    std::vector<Index> keys_;
    std::vector<Side> side_; ///< by key
    trimming::SurfaceSides surface_;
    std::shared_ptr<SurfaceQueries> queries_;
};

/// Removes the cells of an octree leaf mesh (any hexahedral mesh with 2:1 hanging nodes that encloses the
/// domain) that are outside, such that the surface left is a closed manifold and no two cells on either side
/// of a gap share a face. Thesis 3.4; rules: docs/trim.md. The domain's triangles must point outwards
/// (orient_surface). Where the surface is too thin for all cells the mesh is empty and bare_spots tell how
/// thin. Errors: usage (an option out of range); bad_input where nothing is inside, a seed is not in the mesh
/// or not in a kept cell, or the inside leaks to the outer boundary of the mesh, in which case *leak_path
/// gets the octree cells of a shortest path; cancelled. memory: what it knows is not computed again, and what
/// is computed goes into it; the result is the same without it.
Result<TrimOutput> trim(const HexMesh& octree, const Domain& domain, const TrimOptions& options,
                        Context& context, std::vector<Index>* leak_path = nullptr,
                        TrimMemory* memory = nullptr);

/// Counts the faces of the surface left and the places where it is no closed manifold.
void count_faults(TrimOutput& output, const Parallel& parallel);

} // namespace hexopt
