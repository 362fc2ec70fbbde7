#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "mesh/plane_frame.hpp"
#include "mesh/refine_cells.hpp"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hexopt {

/// How small cells are to be: a length in model units, or a number of halvings of the initial mesh, counted
/// from its largest cells. Neither
/// given: the default of the place where it stands; both: refused.
struct TargetSize {
    double size = 0; ///< longest edge of a cell, model units; 0: not given
    int level = -1;  ///< 0 or more; -1: not given

    bool is_given() const { return size > 0 || level >= 0; }
};

/// Size of the cells that meet the patches of one name of the input.
struct PatchTarget {
    std::string patch; ///< one of Domain::names
    TargetSize target;
};

/// Size of the cells that meet feature curves.
struct CurveTarget {
    std::string patch, other_patch; ///< curves that have these beside them; empty: any patch
    TargetSize target;
};

class RegionSurface; // stages/refine/region_surface.hpp

enum class RegionShape : std::uint8_t {
    box,
    sphere,
    cylinder,
    patch,  ///< of the surface that is meshed
    inside, ///< what another surface, a closed one, encloses
    near,   ///< another surface itself, closed or not
};

/// Size of the cells inside a shape or within a distance of it.
struct RegionTarget {
    RegionShape shape = RegionShape::box;
    Point low = Point(0);  ///< box: lower bounds; sphere: centre; cylinder: one end of its axis
    Point high = Point(0); ///< box: upper bounds; cylinder: the other end of its axis
    double radius = 0;     ///< sphere, cylinder; model units
    std::string patch;     ///< patch: its name, empty for the whole surface
    std::string file;      ///< inside, near: what the surface was read from, for messages
    std::shared_ptr<const RegionSurface> surface; ///< inside, near
    double distance = 0; ///< how far outside of the shape the size still holds, model units
    TargetSize target;
    /// Instead of `target`: longest edges along the three axes of the initial mesh's cells (a box: x, y, z).
    /// Cells are split along single axes where these differ. In space only, and not from an initial mesh
    /// with hanging vertices.
    std::optional<std::array<double, 3>> sizes;
};

/// The mesh that refinement starts from (thesis 3.3). Nothing given: a box round the surface whose cells are
/// almost cubes, placed such that none of their planes is a plane at the surface's ends.
struct InitialMeshOptions {
    std::array<Index, 3> cells = {0, 0, 0}; ///< along each axis; {0,0,0}: from base_size
    std::optional<Box> box;                 ///< the user's box; it may cut the surface
    /// Any mesh of hexahedra; excludes the others. Hanging vertices must be named (recognise_hanging()), its
    /// cells be at most one halving apart over faces and edges. 2-D: conforming, zeta across the plane.
    std::optional<HexMesh> mesh;
    double base_size = 0; ///< edge of a cell, model units; 0: a power of two times the surface's size
};

/// What is refined and how far (thesis 3.4, figure 3.6). Sizes bound a cell's longest edge from above.
struct RefineOptions {
    InitialMeshOptions initial;
    TargetSize surface; ///< of cells that meet the surface; not given: found by target_cells
    /// How many cells the mesh shall have inside the domain, roughly, buffer layers included, where the
    /// surface's size is not given; 0: 100,000, in 2-D 20,000. Never more than 6 times as many leaves:
    /// criteria of shape that need more are given up, as for max_cells.
    double target_cells = 0;
    /// Where `surface` is not given: how many levels larger cells on the sides of a box round a body may be
    /// (the patches in the planes of the surface's bounding box, if they cover 80 % of it), 0..20.
    int outer_levels = 3;
    std::vector<PatchTarget> patches; ///< instead of `surface`
    std::vector<CurveTarget> curves;  ///< where finer than the patches
    std::vector<RegionTarget> regions;

    /// A cell that meets the surface is split while the normals (interpolated, within a patch) of its piece
    /// turn by more, degrees, 1..180; 180: never.
    double normal_angle_deg = 30;
    /// The same while the chord of that turn leaves the surface by more (angle times size over 8), as a
    /// fraction of the surface's diagonal, 0..1; 0: never.
    double chord_error_rel = 2e-4;
    /// They may add to the patch's size, 0..20. One more (0: none) where the chord leaves the surface by more
    /// than twice chord_error_rel; with target_cells unless that would make the octree much larger.
    int curvature_levels = 2;
    /// Least number of cells from a point of the surface along its normal to the surface on the other side,
    /// through the mesh (gap) and outside of it (wall); 0: not looked at. 0..100
    double gap_cells = 3;
    double wall_cells = 2;
    /// Least number of cells between curves that share no corner, along a curve and across a patch, 0..100;
    /// 0: not looked at. A closed curve gets three times as many.
    double feature_cells = 3;
    /// How many levels gaps, walls and features may add to the patch's size, 0..20.
    int gap_levels = 2;

    int max_level = 0;                  ///< halvings of the initial mesh; 0: as many as its numbering has
    std::size_t max_cells = 20'000'000; ///< leaves, also those outside of the domain
    int rings = 2; ///< cells of a level between the next finer and the next coarser one, 1..20
    /// A cell on the surface that is split takes along those on the surface within so many cells, 0..20.
    int surface_rings = 2;
    int surface_layers = 1; ///< cells round those on the surface that are no larger than these, 0..20
    bool planar = false;    ///< 2-D: cells are never split along z; faces across z and curves ask for nothing
    PlaneFrame frame;       ///< 2-D: how the plane lies in the model, whose coordinates regions are given in
};

enum class RefineCriterion : std::uint8_t {
    surface_size,
    curve_size,
    region,
    normal_angle,
    gap,
    feature,
    count ///< none
};
inline constexpr std::size_t kCriterionCount = static_cast<std::size_t>(RefineCriterion::count);
/// Short stable name, e.g. "surface_size".
const char* name_of(RefineCriterion criterion);

struct RefineStats {
    std::vector<std::size_t> level_cells; ///< leaves of each level
    /// Cells split because of each criterion: the first in their order that asks.
    std::array<std::size_t, kCriterionCount> split = {};
    std::size_t spread = 0;  ///< split by surface_rings
    std::size_t layers = 0;  ///< by surface_layers
    std::size_t balance = 0; ///< by the balance and `rings`
    /// Cells that a criterion would have split but for max_cells. When a level does not fit, the criteria are
    /// given up one by one from the last of RefineCriterion, each for the rest of the run.
    std::array<std::size_t, kCriterionCount> over_budget = {};
    std::size_t repairs_over_budget = 0; ///< cells that refine_cells() did not split for it
    double surface_size = 0;             ///< largest edge that `surface` allows, model units
    double base_size = 0;                ///< longest edge of the initial mesh, model units

    bool budget_hit() const;
    /// One sentence with the criteria that were given up and for how many cells; empty where none was.
    std::string describe_budget() const;
};

struct RefineOutput {
    CellRefinement refinement;    ///< stays alive to be refined further
    HexMesh octree;               ///< its leaves
    std::vector<Index> leaf_node; ///< per cell of `octree`: node of `refinement`
    RefineStats stats;
    AxisMask mask = kAllAxes;  ///< what a cell is split along
    std::size_t max_cells = 0; ///< as in the options
    /// Per patch of the domain: size of the smallest cells that gaps and walls may get there, model units.
    std::vector<double> finest_size;
};

/// Adapts the initial mesh to the domain. Cells in depth-first order; same input, same bits for any number of
/// threads. Errors: usage (an option out of range, an unknown patch, a region without extent), bad_input (an
/// initial mesh that is not sound or whose hanging vertices CellRefinement::create() refuses), cancelled.
Result<RefineOutput> refine(const Domain& domain, const RefineOptions& options, Context& context);

/// Octrees where the surface's size is not given, one after another, none of them made into a mesh before one
/// is chosen: what a search for a count of cells needs.
class SizeTrials {
  public:
    struct Trial {
        RefineOutput out;    ///< without octree and leaf_node
        double inside = 0;   ///< leaves whose centre is inside the domain, by some thousands of them
        std::size_t cut = 0; ///< leaves that the surface meets
    };

    /// Domain and context are referred to. Error (usage): as refine(), or a surface size that is given.
    static Result<SizeTrials> create(const Domain& domain, const RefineOptions& options, Context& context);
    SizeTrials(SizeTrials&&) noexcept;
    ~SizeTrials();

    /// Size with which there are about so many cells on ordinary surfaces, model units.
    double first_size(double cells) const;
    /// Refines with cells of this size (> 0, finite) on the surface, as refine() does once it has found one.
    /// Errors: as refine().
    Result<Trial> refine_to(double size);
    /// Such a trial again with a level more where chords are steep (RefineOptions::curvature_levels), as all
    /// trials from now on; none, and no later one either, where that would add too many cells. At first
    /// trials are without. Errors: as refine().
    Result<std::optional<Trial>> allow_steep(const Trial& without);
    /// The same for all trials from now on, however many cells that adds.
    void require_steep();
    /// What refine() gives.
    RefineOutput finish(Trial trial) const;

  private:
    class Run;
    friend Result<RefineOutput> refine(const Domain& domain, const RefineOptions& options, Context& context);
    explicit SizeTrials(std::unique_ptr<Run> run);

    std::unique_ptr<Run> run_;
};

/// How many cells RefineOptions::target_cells asks for, and max_cells allows; 0 where the surface's size is
/// given.
double wanted_cells(const RefineOptions& options);

/// Splits named cells of out.octree (repairs of later stages ask for that) and what the balance needs, and
/// replaces octree and leaf_node. Cells at the last level are counted as refused; where max_cells would be
/// passed only the first half of them is split, or a quarter and so on, or nothing, and over_budget set.
RefineCount refine_cells(RefineOutput& out, std::span<const Index> cells, Context& context);

} // namespace hexopt
