#pragma once

#include "stages/optimize/budget.hpp"
#include "stages/optimize/surface_motion.hpp"

#include <memory>

namespace hexopt {

/// What is minimised; see HexGroup.
struct Objective {
    double eps = 0.1;
    double shape_weight = 1;
    double penalty_weight = 0;
    double theta = 0;
    double size_weight = 0; ///< only where the engine keeps_sizes()
};

/// A vertex at the end of its range weighs as much as a hundred tetrahedra or a corner 0.14 below the
/// threshold.
constexpr double limit_weight(const Objective& objective) {
    return 100 * objective.shape_weight + 0.02 * objective.penalty_weight;
}

struct ObjectiveValue {
    double energy = 0;
    double min_jacobian = 0; ///< over the counted tetrahedra, in units of each cell's delta
};

struct CellMeasure {
    float min_sj;   ///< least scaled Jacobian of the corners that can move
    bool has_bad8;  ///< a corner tetrahedron that can move is not positive
    bool has_bad32; ///< one of all 32
};

/// Measures the problem's cells, counted tetrahedra only; entry i belongs to problem.cell_id()[i].
std::vector<CellMeasure> measure_cells(const Problem& problem, std::span<const Point> positions,
                                       const Parallel& parallel);

struct NewtonOptions {
    int max_steps = 8;
    double min_relative_decrease = 1e-4; ///< stop once a step lowers the energy by less than this fraction
    double cg_tolerance = 1e-2;
    int cg_max_iterations = 100;
};

struct NewtonResult {
    ObjectiveValue start, end;
    int steps = 0, cg_iterations = 0;
    bool stalled = false; ///< the line search found no decrease
};

/// What the arithmetic can tell apart.
struct Resolution {
    double valid_eps = 1e-12;  ///< regularisation once all tetrahedra are positive
    double least_valid = 1e-9; ///< a positive J below this is rounding: the barrier would hold it there
};

/// The steps of the default method on one problem. Each begins at the positions that it was opened with, as
/// they then are, and leaves its result there; hanging vertices follow their masters.
class Minimiser {
  public:
    virtual ~Minimiser() = default;

    virtual const Problem& problem() const = 0;
    virtual Resolution resolution() const { return {}; }
    /// Target sizes from the current positions (Problem::update_lengths); before anything else.
    virtual void update_lengths() = 0;
    virtual ObjectiveValue evaluate(const Objective& objective) = 0;
    /// Newton's method with a semidefinite Hessian model, conjugate gradients and Armijo backtracking.
    virtual NewtonResult minimise(const Objective& objective, const NewtonOptions& options) = 0;
    /// Solves the weighted graph Laplacian for the dofs off the boundary; the number of iterations.
    virtual int start_harmonically(std::span<const std::uint8_t> on_boundary) = 0;
    /// Counted tetrahedra only; entry i belongs to problem().cell_id()[i].
    virtual std::vector<CellMeasure> measure() = 0;
    /// Max-min of single vertices, colour after colour, until the least scaled Jacobian reaches `target` or
    /// stays as it is. Returns the number of sweeps. Only where the engine raises_vertices().
    virtual int raise_vertices(double target) = 0;
};

/// Where minimisers come from: the host's vectorised code, or kernels on a device.
class Engine {
  public:
    virtual ~Engine() = default;
    /// motion: null where every dof is free; with its surface and limits it must outlive the minimiser, as
    /// must problem and positions.
    virtual std::unique_ptr<Minimiser> open(Problem& problem, std::vector<Point>& positions,
                                            const SurfaceMotion* motion) = 0;
    /// What a unit of the host's work buys, 0..1: max-min shortens its budget by this.
    virtual double speed() const { return 1; }
    virtual bool raises_vertices() const { return false; }
    /// Whether parts that share no cells are better minimised one by one: each then has its own steps and its
    /// own regularisation. Devices need everything at once.
    virtual bool takes_parts() const { return true; }
    /// Whether Motion's face limits are known.
    virtual bool knows_face_limits() const { return true; }
    /// Whether Objective::size_weight is known.
    virtual bool keeps_sizes() const { return true; }
};

class HostEngine final : public Engine {
  public:
    explicit HostEngine(Budget& budget) : budget_(budget) {}
    std::unique_ptr<Minimiser> open(Problem& problem, std::vector<Point>& positions,
                                    const SurfaceMotion* motion) override;

  private:
    Budget& budget_;
};

} // namespace hexopt
