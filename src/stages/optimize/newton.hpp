#pragma once

#include "stages/optimize/budget.hpp"
#include "stages/optimize/hex_kernels.hpp"
#include "stages/optimize/motion.hpp"

namespace hexopt {

/// What is minimised; see HexGroup.
struct Objective {
    double eps = 0.1;
    double shape_weight = 1;
    double penalty_weight = 0;
    double theta = 0;
};

struct ObjectiveValue {
    double energy = 0;
    double min_jacobian = 0; ///< over the counted tetrahedra, in units of each cell's delta
};

struct CellMeasure {
    float min_sj;   ///< least scaled Jacobian of the corners that can move
    bool has_bad8;  ///< a corner tetrahedron that can move is not positive
    bool has_bad32; ///< one of all 32
};

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

/// Measures the problem's cells, counted tetrahedra only; entry i belongs to problem.cell_id()[i].
std::vector<CellMeasure> measure_cells(const Problem& problem, std::span<const Point> positions,
                                       const Parallel& parallel);

/// Newton's method with a semidefinite Hessian model, conjugate gradients and Armijo backtracking over all
/// dofs of a problem at once. Keeps the mesh's positions up to date; hanging vertices follow their masters.
class Newton {
  public:
    /// motion: null where every dof is free.
    Newton(Problem& problem, std::vector<Point>& positions, const Motion* motion, Budget& budget);

    ObjectiveValue evaluate(const Objective& objective) const { return evaluate_at(objective, positions_); }
    NewtonResult minimise(const Objective& objective, const NewtonOptions& options);

    Problem& problem() { return problem_; }
    std::vector<Point>& positions() { return positions_; }
    BlockMatrix& matrix() { return matrix_; }

  private:
    ObjectiveValue evaluate_at(const Objective& objective, std::span<const Point> positions) const;
    ObjectiveValue compute_gradient(const Objective& objective);
    void assemble(const Objective& objective);
    double limit_energy(const Objective& objective, std::span<const Point> positions) const;
    void add_limit_gradient(const Objective& objective);
    void add_limit_hessian(const Objective& objective);
    bool search_line(const Objective& objective, double slope, ObjectiveValue& value);

    Problem& problem_;
    std::vector<Point>& positions_;
    const Motion* motion_;
    Budget& budget_;
    BlockMatrix matrix_;
    std::vector<Point> gradient_, step_, trial_;
    std::vector<Freedom> freedom_;
};

} // namespace hexopt
