#pragma once

#include "mesh/colouring.hpp"
#include "stages/optimize/budget.hpp"
#include "stages/optimize/local_energy.hpp"

namespace hexopt {

/// Passes over the free vertices of a mesh, each of which moves one vertex at a time in its ball: coloured,
/// so that balls of vertices that move at once share no cell; the same bits for any number of threads.
/// Vertices that hang follow their masters at once. Every pass spends one iteration of the budget.
class LocalSweeps {
  public:
    /// movable: per vertex; hanging vertices follow. positions: of the mesh, kept up to date; target sizes
    /// are measured now and stay: a cell whose target followed its size would have nothing to hold it.
    LocalSweeps(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable,
                std::vector<Point>& positions, Budget& budget);

    /// Per cell: 1 where one of the given tetrahedra (bits of hex::kTetEdge) is not positive.
    std::vector<std::uint8_t> find_concave(std::uint32_t tets) const;
    std::size_t count_concave(std::uint32_t tets) const;

    /// Least J of the given tetrahedra, edges divided by the cells' targets; those that cannot move included.
    double find_least_jacobian(std::uint32_t tets) const;
    double find_min_sj() const; ///< least scaled Jacobian of all corners

    /// Algorithm 1 on every vertex with a tetrahedron that is not positive. Returns how many vertices moved.
    std::size_t untangle(std::uint32_t tets, UntangleTarget target);

    /// Algorithm 2: one 1-D minimisation along steepest descent a vertex. Vertices with a tangled ball are
    /// left out where the energy has a barrier.
    void optimise(std::uint32_t tets, const LocalEnergy& energy, GradientKind gradient);

    /// One Jacobi step of the weighted steepest descent of section 3.6: every vertex finds its step in the
    /// old mesh, then all move by `relaxation` of it. Accepts tangled meshes. Returns the energy before.
    double step_jacobi(std::uint32_t tets, const LocalEnergy& energy, double relaxation);

    /// Moves the free vertices of the flagged cells to the weighted mean of their neighbours; smart: only
    /// where the least scaled Jacobian of the ball does not fall.
    void smooth(std::span<const std::uint8_t> cells, bool smart);

  private:
    template <class Take>
    void measure(std::uint32_t tets, const Take& take) const;
    template <class Visit>
    void for_each_vertex(const Visit& visit);
    bool touches(Index vertex, std::span<const std::uint8_t> cells) const;
    void move(Index vertex, const Point& d);

    const HexMesh& mesh_;
    const Topology& topology_;
    std::vector<Point>& positions_;
    Budget& budget_;
    Stencils stencils_;
    Colouring colouring_;
    Csr<Index> followers_; ///< per vertex: rows of mesh.hanging that depend on it; empty if none hangs
    CellTargets targets_;
};

} // namespace hexopt
