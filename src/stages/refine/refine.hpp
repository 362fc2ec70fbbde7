#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "mesh/refine_cells.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace hexopt {

/// How small cells are to be: a length in model units, or a number of halvings of the initial mesh. Neither
/// given: the default of the place where it stands.
struct TargetSize {
    double size = 0; ///< longest edge of a cell, model units; 0: not given
    int level = -1;  ///< 0..max_level; -1: not given

    bool is_given() const { return size > 0 || level >= 0; }
};

/// Size near the patches of one name of the input.
struct PatchTarget {
    std::string patch; ///< one of Domain::names
    TargetSize target;
};

/// The mesh that refinement starts from (thesis 3.3). Nothing given: a box round the surface whose cells are
/// almost cubes of `base_size`.
struct InitialMeshOptions {
    std::array<Index, 3> cells = {0, 0, 0}; ///< along each axis; {0,0,0}: from base_size
    std::optional<Box> box;                 ///< the user's box; it may cut the surface
    std::optional<HexMesh> mesh;            ///< any conforming mesh, then `box` and `cells` are not looked at
    double base_size = 0; ///< edge of a cell, model units; 0: a power of two times the surface's size
};

/// What is refined and how far (thesis 3.4, figure 3.6). Sizes bound a cell's longest edge from above.
struct RefineOptions {
    InitialMeshOptions initial;
    TargetSize surface;               ///< cells that meet the surface; not given: chosen by target_cells
    double target_cells = 100e3;      ///< about how many cells inside the domain the default size aims at
    std::vector<PatchTarget> patches; ///< finer or coarser than `surface`, by patch
    /// A cell that meets the surface is split while the normals (interpolated, within a patch) of its piece
    /// turn by more, degrees, 0..180; 180: never.
    double normal_angle_deg = 30;
    int curvature_levels = 2; ///< how many levels the criterion of normals may add to the surface's size
    int max_level = 0;        ///< halvings of the initial mesh, 0: as many as there are
    std::size_t max_cells = 20'000'000; ///< refinement ends before it would have more
    int rings = 2; ///< cells of a level between the next finer and the next coarser one, 1..20
    int surface_rings =
        2; ///< a cell split by its shape takes those on the surface along that are so near, 0..20
    int surface_layers = 1; ///< cells round those on the surface that are no larger than these, 0..20
    bool planar = false;    ///< 2-D: cells are never split along z
};

enum class RefineCriterion : std::uint8_t { surface_size, normal_angle, count };
const char* name_of(RefineCriterion criterion);

struct RefineStats {
    std::vector<std::size_t> level_cells; ///< leaves of each level
    /// Cells split because of each criterion (the first in this order that asks), of their neighbours on the
    /// surface, and of the balance.
    std::array<std::size_t, static_cast<std::size_t>(RefineCriterion::count)> split = {};
    std::size_t spread = 0;
    std::size_t layers = 0; ///< by surface_layers
    std::size_t balance = 0;
    std::size_t budget_refused = 0; ///< cells that would have been split but for max_cells
    double surface_size = 0;        ///< what TargetSize of `surface` came to, model units
    double base_size = 0;           ///< longest edge of the initial mesh, model units
};

struct RefineOutput {
    CellRefinement refinement;    ///< stays alive to be refined further
    HexMesh octree;               ///< its leaves
    std::vector<Index> leaf_node; ///< per cell of `octree`: node of `refinement`
    RefineStats stats;
    AxisMask mask = kAllAxes;  ///< what a cell is split along
    int rings = 1;             ///< as in the options
    std::size_t max_cells = 0; ///< as in the options
};

/// Adapts the initial mesh to the domain. Cells in depth-first order; same input, same bits for any number of
/// threads. Errors: usage (an option out of range, an unknown patch), bad_input (an initial mesh that is
/// not sound or has hanging vertices), cancelled.
Result<RefineOutput> refine(const Domain& domain, const RefineOptions& options, Context& context);

/// Splits named cells of out.octree (repairs of later stages ask for that) and what the balance needs, and
/// replaces octree and leaf_node. Cells beyond the budget or the last level are counted as refused.
RefineCount refine_cells(RefineOutput& out, std::span<const Index> cells, Context& context);

} // namespace hexopt
