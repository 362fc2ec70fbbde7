#pragma once

#include "mesh/stencil.hpp"
#include "stages/optimize/lp_kernel.hpp"
#include "stages/optimize/optimize.hpp"

#include <span>

namespace hexopt {

/// Target sizes and weights of all cells, from which energies become comparable.
struct CellTargets {
    std::vector<double> length; ///< target edge length, the same along xi, eta and zeta, model units
    std::vector<double> weight; ///< of the cell's energy: 4^-level (V_target^(2/3)) across levels, else 1
};

/// Mean edge length of every cell at the given positions, averaged with the cells around it a few times so
/// that tangles do not set targets; not below 1e-3 of the mean over the mesh.
CellTargets measure_targets(const HexMesh& mesh, const Topology& topology, std::span<const Point> positions,
                            const Parallel& parallel);

/// A tetrahedron as a function of the displacement d of the vertex whose ball it belongs to: its edges along
/// xi, eta, zeta, divided by the target length, are edge[i] + slope[i] * d, whatever hangs on the vertex. So
/// J = det is affine in d and the sum S of squared edges quadratic (d x d = 0). Source: thesis 4.2.1, 4.3.3.
struct BallTet {
    std::array<Point, 3> edge;
    std::array<double, 3> slope; ///< per model unit
    double jacobian;             ///< J at d = 0
    Point jacobian_slope;        ///< J(d) = jacobian + dot(jacobian_slope, d)
    double weight;
};

/// The tetrahedra that depend on one vertex (Ball(N) of the thesis, with what hangs on N).
class Ball {
  public:
    /// tets: which tetrahedra count, bits of hex::kTetEdge. Keeps its memory between calls.
    void gather(const HexMesh& mesh, std::span<const Point> positions, const Stencils& stencils,
                const CellTargets& targets, Index vertex, std::uint32_t tets);

    std::span<const BallTet> tets() const { return tets_; }
    /// Displacements that keep the vertex in the bounding box of the ball's cells.
    const PointBox& box() const { return box_; }
    /// Mean target length of the ball's cells, model units.
    double mean_length() const { return mean_length_; }
    /// Some tetrahedron is not positive.
    bool is_tangled() const;
    /// Where each tetrahedron is positive, in displacements, normalised.
    std::vector<HalfSpace> half_spaces() const;
    /// Least J / (product of the edge lengths) of the displaced ball, -1..1.
    double quality(const Point& d) const;

  private:
    std::vector<BallTet> tets_;
    PointBox box_;
    double mean_length_ = 0;
};

/// What Algorithm 2 minimises. eps: regularisation of J, for Energy::regularised only.
struct LocalEnergy {
    Energy kind = Energy::structural;
    double eps = 0.1;
};

/// True where the energy is infinite outside the kernel: such a ball must not be tangled.
constexpr bool has_barrier(Energy e) { return e == Energy::structural || e == Energy::shape; }

/// Sum of weight * energy of one tetrahedron over the ball displaced by d. Infinite outside the kernel where
/// the energy has a barrier. On edges divided by their targets, with S = tr G, I2 = sum |e_i x e_j|^2:
/// structural S / J^3 (4.14 with J = det G read as such), shape S / (3 J^(2/3)), hyperelastic S + I2 - 6 J +
/// (J - 1)^2 (3.2), regularised S / (3 chi^(2/3)), chi = (J + sqrt(J^2 + eps^2)) / 2.
double evaluate_energy(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& d);

/// Its gradient at d, exact.
Point evaluate_gradient(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& d);

/// Its gradient at d = 0 by forward differences (4.24); step: 1e-4 of the mean target length in the thesis.
Point difference_gradient(std::span<const BallTet> tets, const LocalEnergy& energy, double step);

/// Largest t <= limit, t >= 0, with the least energy at t * direction: 1-D minimisation along a descent
/// direction (not necessarily a unit vector). 0 where no step lowers the energy.
double minimise_on_line(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& direction,
                        double limit);

} // namespace hexopt
