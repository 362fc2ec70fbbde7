#pragma once

#include "stages/optimize/boundary_guard.hpp"
#include "stages/optimize/minimiser.hpp"

namespace hexopt {

/// How the stage goes about it, on the host and on devices.
namespace max_min {

inline constexpr double kPenaltyWeight = 100;
inline constexpr double kMargin = 0.02;
inline constexpr int kRings = 3;
/// Cells times Newton steps that the stage may spend: enough for small meshes to converge, a fixed share for
/// large ones.
inline constexpr double kWorkPerCell = 20, kWorkAtLeast = 8e6;
inline constexpr double kWorkPerCgIteration = 0.1; ///< against a Newton step without its conjugate gradients
inline constexpr double kWorthwhile = 2e-3;        ///< rise of the minimum for which a strategy is kept

/// How far to raise the threshold above the minimum, and how much the shape of all cells counts meanwhile.
/// One is used while it helps, then the next; the stage ends when all fail in a row.
struct Strategy {
    double rise, shape_weight;
};
inline constexpr Strategy kStrategies[] = {{0.05, 1e-3}, {0.05, 1e-4}, {0.02, 1e-4},
                                           {0.02, 1e-3}, {0.01, 1e-5}, {0.005, 1e-4}};
/// To which places that share no cells are raised one by one, before the worst of all.
inline constexpr double kLevels[] = {0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5};
/// Where to stop at the latest: rounding keeps even a lattice below 1.
inline constexpr double kPerfect = 0.9995;

} // namespace max_min

/// What may move and where.
struct Movement {
    const HexMesh* mesh = nullptr;
    const Topology* topology = nullptr;
    std::vector<std::uint8_t> movable;      ///< per vertex
    const BoundaryModel* surface = nullptr; ///< null: no boundary vertex moves
    SurfaceLimits* limits = nullptr;        ///< with surface; bands are opened where cells need them
    const BoundaryGuard* guard = nullptr;   ///< with surface
    const LimitedFaces* faces = nullptr;    ///< limits these instead of single vertices; with surface
    Tangents tangents = Tangents::smooth;   ///< of the surface
    std::uint32_t tets = kAllTets;          ///< which tetrahedra count
    std::span<const float> inverse_stretch; ///< see Problem
    double band = 0; ///< how far needy boundary vertices may leave the surface, model units
};

struct MaxMinResult {
    double min_sj_before = 0, min_sj_after = 0; ///< over the corners that can move
    int rounds = 0, newton_steps = 0, cg_iterations = 0;
    double work = 0; ///< spent
};

/// Per vertex: 1 for the movable vertices of the seed cells and of `rings` rings of cells around them, and
/// for movable masters of vertices that hang there.
std::vector<std::uint8_t> movable_neighbourhood(const HexMesh& mesh, const Topology& topology,
                                                std::span<const std::uint8_t> movable,
                                                std::span<const Index> seeds, int rings);

/// Lets the boundary vertices of the given cells, and of one ring around them, leave the surface by
/// movement.band. Returns the vertices whose band was opened.
std::vector<Index> open_bands(const Movement& movement, std::span<const Index> cells);

/// worst: all for the worst cells of the mesh. parts: places that share no cells rise one by one, and what
/// cannot rise in one of them does not stop the others; where all have risen, the worst go on. parts_first:
/// the same, and the worst go on in any case, with as much work again.
enum class RaiseOrder { worst, parts, parts_first };

/// Raises the least scaled Jacobian: Newton on the neighbourhoods of the worst cells, shape energy plus a
/// penalty on every corner below a threshold that rises with the minimum. positions are changed only where
/// the minimum rises and no tetrahedron turns bad. eps: regularisation of the shape energy; target: stop once
/// the minimum reaches it; work: cells times Newton steps that may be spent.
MaxMinResult raise_worst_cells(Movement& movement, Engine& engine, std::vector<Point>& positions, double eps,
                               double target, double work, RaiseOrder order, Budget& budget);

} // namespace hexopt
