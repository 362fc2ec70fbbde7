#include "stages/optimize/robust.hpp"

#include "stages/optimize/max_min.hpp"
#include "stages/optimize/untangle.hpp"

#include <algorithm>
#include <optional>

namespace hexopt {

namespace {

/// How far quads may leave a curved surface by mere sliding when the user names no deviation, relative to the
/// diagonal.
constexpr double kSlidingDeviationRel = 0.005;
/// The guard samples: what it allows is a little less than what the user does.
constexpr double kGuardMargin = 0.9;
/// Share of the deviation that a vertex itself may leave the surface by; the rest is for the quads between.
constexpr double kBandShare = 0.8;
constexpr int kMaxNarrowings = 6;

class RobustRun {
  public:
    RobustRun(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
              const OptimizeOptions& options, std::vector<Point>& positions, Budget& budget,
              const std::function<void()>& keep_if_better, OptimizeStats& stats)
        : mesh_(mesh), topology_(topology),
          surface_(options.boundary == BoundaryMode::slide ? surface : nullptr), options_(options),
          positions_(positions), budget_(budget), keep_if_better_(keep_if_better), stats_(stats) {}

    void run() {
        Context& context = budget_.context();
        context.report("untangle", 0.02);
        untangle_interior();
        keep_if_better_();
        if (surface_ && !budget_.exhausted()) {
            raise_with_fixed_boundary();
            context.report("slide", 0.4);
            slide();
            keep_if_better_();
        }
        if (!options_.max_min) return;
        context.report("max-min", 0.6);
        raise_worst();
        if (surface_ && options_.max_deviation_rel > 0 && !budget_.exhausted()) {
            context.report("max-min in the band", 0.8);
            let_corners_move();
            raise_worst();
        }
    }

  private:
    /// Sliding ends below what a fixed boundary allows on some meshes: that result is kept as one to beat.
    /// Sliding itself starts from the smoother state before it.
    void raise_with_fixed_boundary() {
        if (!options_.max_min) return;
        const std::vector<Point> untangled = positions_;
        raise_worst();
        positions_ = untangled;
    }

    void raise_worst() {
        const MaxMinResult result = raise_worst_cells(movement_, positions_, eps_, options_.min_sj, budget_);
        stats_.newton_steps += result.newton_steps;
        stats_.cg_iterations += result.cg_iterations;
        keep_if_better_();
    }

    void untangle_interior() {
        movement_.mesh = &mesh_;
        movement_.topology = &topology_;
        movement_.tets = tets_of(options_.decomposition);
        movement_.movable.resize(mesh_.vertex_count());
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
            movement_.movable[v] = !topology_.on_boundary[v];
        Problem problem(mesh_, topology_, movement_.movable, movement_.tets);
        problem.update_lengths(positions_, budget_.parallel());
        Newton newton(problem, positions_, nullptr, budget_);
        const auto count_bad = [&] {
            const auto cells = measure_cells(problem, positions_, budget_.parallel());
            return std::count_if(cells.begin(), cells.end(),
                                 [](const CellMeasure& c) { return c.has_bad32; });
        };
        if (const auto bad = count_bad(); bad > 0) {
            const std::vector<Point> before = positions_;
            stats_.cg_iterations += harmonic_start(newton, topology_.on_boundary, budget_);
            if (count_bad() >= bad) positions_ = before;
        }
        finish_untangling(newton);
    }

    void finish_untangling(Newton& newton) {
        const UntangleResult result = untangle_regularised(newton, budget_);
        stats_.newton_steps += result.newton_steps;
        stats_.cg_iterations += result.cg_iterations;
        eps_ = result.eps;
    }

    void slide() {
        const double diagonal = surface_->diagonal();
        const double deviation =
            (options_.max_deviation_rel > 0 ? options_.max_deviation_rel : kSlidingDeviationRel) * diagonal;
        limits_ = compute_surface_limits(mesh_, topology_, *surface_, deviation, budget_.parallel());
        const auto bound = surface_->associations();
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
            movement_.movable[v] = bound[v].kind == EntityKind::interior ||
                                   bound[v].kind == EntityKind::patch || bound[v].kind == EntityKind::curve;
        guard_.emplace(mesh_, topology_, *surface_, limits_, kGuardMargin * deviation, budget_.parallel());
        movement_.surface = surface_;
        movement_.limits = &limits_;
        movement_.guard = &*guard_;
        band_ = kBandShare * options_.max_deviation_rel * diagonal;
        if (const auto bad = slide_within_deviation(); !bad.empty() && band_ > 0) {
            let_corners_move();
            open_bands(movement_, bad);
            slide_within_deviation();
            movement_.band = 0;
        }
    }

    /// Everything that may move once bands can open: corners too, though each stays until its own band does.
    void let_corners_move() {
        const auto bound = surface_->associations();
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
            if (bound[v].kind == EntityKind::corner) movement_.movable[v] = 1;
        movement_.band = band_;
    }

    /// Slides, narrows the limits where quads deviate too far, and slides on from there.
    std::vector<Index> slide_within_deviation() {
        const std::vector<Point> before = positions_;
        for (int narrowing = 0; narrowing < kMaxNarrowings && !budget_.exhausted(); ++narrowing) {
            const std::vector<Index> bad = slide_all();
            const auto violators =
                guard_->violators(positions_, guard_->boundary_vertices(), budget_.parallel());
            if (violators.empty()) return bad;
            guard_->tighten(positions_, violators, limits_);
        }
        positions_ = before;
        Problem problem(mesh_, topology_, movement_.movable);
        problem.update_lengths(positions_, budget_.parallel());
        return bad_cells(problem);
    }

    std::vector<Index> bad_cells(const Problem& problem) const {
        std::vector<Index> bad;
        const auto cells = measure_cells(problem, positions_, budget_.parallel());
        for (std::size_t i = 0; i < cells.size(); ++i)
            if (cells[i].has_bad32) bad.push_back(problem.cell_id()[i]);
        return bad;
    }

    /// Untangles with everything movable; returns the cells that stay bad.
    std::vector<Index> slide_all() {
        Problem problem(mesh_, topology_, movement_.movable, movement_.tets);
        SurfaceMotion motion(problem, *surface_, limits_);
        Newton newton(problem, positions_, &motion, budget_);
        finish_untangling(newton);
        return bad_cells(problem);
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel* surface_;
    const OptimizeOptions& options_;
    std::vector<Point>& positions_;
    Budget& budget_;
    const std::function<void()>& keep_if_better_;
    OptimizeStats& stats_;
    Movement movement_;
    SurfaceLimits limits_;
    std::optional<DeviationGuard> guard_;
    double band_ = 0;
    double eps_ = 1e-12;
};

} // namespace

void optimize_robust(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                     const OptimizeOptions& options, std::vector<Point>& positions, Budget& budget,
                     const std::function<void()>& keep_if_better, OptimizeStats& stats) {
    RobustRun(mesh, topology, surface, options, positions, budget, keep_if_better, stats).run();
}

} // namespace hexopt
