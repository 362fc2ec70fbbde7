#pragma once

#include "core/context.hpp"
#include "core/csr.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace hexopt {

class BoundaryModel; // domain/boundary_model.hpp
struct DeviceTarget; // stages/optimize/device_driver.hpp

enum class OptimizeMethod {
    robust, ///< regularised energy over all 32 tetrahedra, Newton-PCG, then max-min (default)
    thesis, ///< Algorithms 1-3 of the thesis with the printed loop counts
};

/// automatic: the method's own, regularised for robust and structural for thesis.
enum class Energy { structural, shape, hyperelastic, regularised, automatic };

enum class Decomposition { corner8, path24, all32 };

enum class BoundaryMode { fixed, slide };

enum class Effort {
    normal, ///< all that the method can do
    quick,  ///< a bounded time a cell, for meshes as a mesher makes them: sound but near the boundary
};

/// Where Algorithm 1 puts a vertex: the mean of the kernel's extreme points along the six axis directions
/// (4.11); the same, and along twenty more where that fails (4.12, as printed); or the kernel's deepest
/// point, with vertices that block one another untangled together.
enum class UntangleTarget { axis, extended, deepest_point };

/// finite_difference: (4.24), as printed.
enum class GradientKind { analytic, finite_difference };

/// What the optimizer may do. Lengths are in model units unless the name says otherwise.
struct OptimizeOptions {
    OptimizeMethod method = OptimizeMethod::robust;
    /// robust: regularised, or shape, which is the same but refuses a tangled input; thesis: any.
    Energy energy = Energy::automatic;
    /// Which tetrahedra are optimized; all 32 count for what is reported and kept. thesis: all32 takes the 8
    /// and the 24 in turn.
    Decomposition decomposition = Decomposition::all32;
    BoundaryMode boundary = BoundaryMode::slide;             ///< the thesis method needs the boundary fixed
    UntangleTarget untangle = UntangleTarget::deepest_point; ///< thesis method only
    GradientKind gradient = GradientKind::analytic;          ///< thesis method only
    double max_deviation_rel = 0; ///< 0..0.1 of the bounding-box diagonal; 0: on the surface, features exact
    Effort effort = Effort::normal; ///< quick: the robust method only
    /// With slide: where the boundary vertices are on their entities means nothing, as a mesher has only just
    /// put them there. They may go anywhere on them; how far quads are from the surface, which then is a
    /// matter of cell sizes, is not guarded, and max_deviation_rel is what vertices may leave it by.
    /// Kept is the state with the fewest bad cells, though its minimum may be below the input's.
    bool fresh_boundary = false;
    /// Per cell of the mesh, along xi, eta and zeta; only their ratios count: the ideal cell is a box of
    /// these proportions. Empty: cubes. Robust method on the host only; must outlive the run.
    std::span<const std::array<double, 3>> target_lengths;
    /// Per cell: 1 where an earlier run with a fresh boundary and the same options ended as the input is, all
    /// round: only what is bad moves there. Empty: nowhere. Effort::quick only; must outlive the run.
    std::span<const std::uint8_t> finished_cells;
    bool explain_bad_cells = true; ///< prove which of those left nobody could have mended
    bool max_min = true;           ///< final stage that raises the worst cells; robust method only
    /// 1..4: with slide and at most 40,000 cells, from how many states and in how many orders the worst cells
    /// are raised, one after another; the best is kept. On a device at most 2 differ.
    int starts = 4;
    double min_sj = 1; ///< stop once the minimum scaled Jacobian reaches this; -1..1
    double time_limit_s = std::numeric_limits<double>::infinity();
    int max_iterations = 1000000; ///< Newton steps or sweeps, all phases together; >= 1
};

/// The energy that a run with these options minimises.
constexpr Energy resolved_energy(const OptimizeOptions& options) {
    if (options.energy != Energy::automatic) return options.energy;
    return options.method == OptimizeMethod::thesis ? Energy::structural : Energy::regularised;
}

/// What was reached, as counted by the optimizer itself (the report measures the written mesh anew).
struct OptimizeStats {
    std::size_t bad8_before = 0, bad8_after = 0;   ///< cells with a non-positive corner tetrahedron
    std::size_t bad32_before = 0, bad32_after = 0; ///< cells with a non-positive one of all 32 tetrahedra
    double min_sj_before = 0, min_sj_after = 0;
    int newton_steps = 0, sweeps = 0, cg_iterations = 0;
    double seconds = 0;
    bool restored_input = false; ///< nothing better than the input was found, which is returned unchanged
    std::vector<Index> infeasible_cells; ///< cells proved to stay bad wherever the free vertices go
    Csr<Index> infeasible_groups; ///< at least one cell of each row is proved to stay bad; rows disjoint
    std::size_t min_bad8 = 0, min_bad32 = 0; ///< proved: no placing of the free vertices leaves fewer
    std::vector<std::string> notes;          ///< what the user should know, one sentence each
};

/// Improves the positions of `mesh`; connectivity and hanging constraints stay. Never worse: the counts of
/// bad cells and the minimum scaled Jacobian never end below the input's. `surface`: where boundary vertices
/// may move; ignored with BoundaryMode::fixed, required with slide. Cancelled: returns ErrorCode::cancelled
/// and leaves in `mesh` the best valid state so far (never worse than the input). Source: regularised energy
/// after Garanzha et al. 2021; thesis chapter 4 for the rest.
/// device: where the robust method's steps are computed (optimize_on_device()); null: by the host's
/// vectorised code. replaced: gets the input's positions, once there are better ones; else it is left as it
/// is.
Result<OptimizeStats> optimize(HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                               const OptimizeOptions& options, Context& context,
                               const DeviceTarget* device = nullptr, std::vector<Point>* replaced = nullptr);

/// Sets in stats what is proved of cells that are still bad, given what may move, and adds a note.
void explain_bad_cells(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                       const OptimizeOptions& options, const Parallel& parallel, OptimizeStats& stats);

} // namespace hexopt
