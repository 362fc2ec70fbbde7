#include "stages/optimize/robust.hpp"

#include "domain/deviation.hpp"
#include "stages/optimize/cell_search.hpp"
#include "stages/optimize/deviation_guard.hpp"
#include "stages/optimize/max_min.hpp"
#include "stages/optimize/mesh_measure.hpp"
#include "stages/optimize/untangle.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <optional>
#include <utility>

namespace hexopt {

namespace {

/// How far quads may leave a curved surface by mere sliding when the user names no deviation, relative to the
/// diagonal.
constexpr double kSlidingDeviationRel = 0.005;
/// The guard samples: what it allows is a little less than what the user does.
constexpr double kGuardMargin = 0.9;
/// Of what the user allows: up to here samples are believed, beyond it the deviation is measured.
/// 0.95 let one through that was 1.03 between the samples.
constexpr double kSurelyWithin = 0.8;
/// How much more than at the start the boundary may deviate from a surface that is not its own.
constexpr double kStartMargin = 1.1;
/// Share of the deviation that a vertex itself may leave the surface by; the rest is for the quads between.
constexpr double kBandShare = 0.8;
constexpr int kMaxNarrowings = 12;
constexpr int kFreezeAfter = 6; ///< narrowings after which vertices that still go too far stay at their start
constexpr float kNarrower = 0.6f;
constexpr int kRaiseNarrowings = 2; ///< of the sweeps over single vertices

/// Effort::quick: cells are poor from this mean energy of a tetrahedron on (1: cube), and what is moved are
/// the rings round them.
constexpr double kPoorEnergy = 1.3;
constexpr int kPoorRings = 3;
constexpr int kQuickRounds = 2; ///< of the first pass
/// Of the second one with a fresh boundary: what is bad after that mostly stays so.
constexpr int kFreshRounds = 12;
/// Of cells with a fresh boundary (HexGroup::size_weight), first and where they stay tangled: without it
/// cells that slide freely shrink to a point round any place that cannot be untangled.
constexpr double kSizeWeight = 1, kTangledSizeWeight = 3;
constexpr double kQuickWorkPerCell = 8, kQuickWorkAtLeast = 1e5;

/// Work of one max-min stage (see max_min::kWorkPerCell) that even a small mesh may take, shared by the
/// starts; up to how many cells there is more than one.
constexpr double kSlidingWorkAtLeast = 6e6;
constexpr std::size_t kMoreStartsUpTo = 40000;
/// The best state goes on with its limits renewed while that lifts the minimum by more than this.
constexpr double kWorthRenewing = 0.01;
/// Share of the work of a stage that may be spent once more with faces limited instead of vertices:
constexpr double kFaceWork = 0.3, kBadFaceWork = 1; ///< the latter where cells are still bad
/// With limits so much narrower where it left the deviation that the user admits.
constexpr float kNarrowerAgain = 0.9f;

class RobustRun {
  public:
    RobustRun(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
              const OptimizeOptions& options, Engine& engine, std::vector<Point>& positions, Budget& budget,
              const std::function<void()>& keep_if_better, OptimizeStats& stats)
        : mesh_(mesh), topology_(topology),
          surface_(options.boundary == BoundaryMode::slide ? surface : nullptr), options_(options),
          engine_(engine), positions_(positions), budget_(budget), keep_if_better_(keep_if_better),
          stats_(stats), inverse_stretch_(inverse_stretches(options.target_lengths)) {}

    void run() {
        Context& context = budget_.context();
        movement_.mesh = &mesh_;
        movement_.topology = &topology_;
        movement_.tets = tets_of(options_.decomposition);
        movement_.inverse_stretch = inverse_stretch_;
        if (surface_ && options_.effort == Effort::quick) {
            slide_where_needed();
            context.report("max-min", 0.5);
            raise_sliding();
            return;
        }
        context.report("untangle", 0.02);
        untangle_interior();
        keep_if_better_();
        if (surface_) return slide_from_starts();
        context.report("max-min", 0.6);
        raise_worst();
    }

  private:
    /// Where max-min begins.
    struct Start {
        std::vector<Point> positions;
        SurfaceLimits limits;
        std::vector<std::uint8_t> movable;
    };

    /// Of SurfaceLimits, before anything narrowed them.
    struct FirstLimits {
        std::vector<float> reach, band_share;
    };

    /// Where sliding ends depends on where it starts: the smooth state that untangling leaves, slid, or the
    /// one that max-min reaches with the boundary fixed, which also is a result to beat; and on whether the
    /// worst cells are raised together or place by place, on devices on whether single vertices are raised
    /// before the neighbourhoods or after. None of the four is best on all meshes; the best is kept.
    void slide_from_starts() {
        if (budget_.exhausted()) return;
        const std::vector<Point> smooth = positions_;
        raise_worst();
        Start raised{std::exchange(positions_, smooth), {}, {}};
        budget_.context().report("slide", 0.3);
        set_up_sliding(mesh_.positions); // the best so far; all starts take these limits
        raised.limits = limits_;
        raised.movable = movement_.movable;
        slide(movement_.movable);
        keep_if_within();
        vertices_first_ = false;
        const FirstLimits first{limits_.reach, limits_.band_share};
        if (count_starts() == 1) {
            std::exchange(raised, {});
            budget_.context().report("max-min", 0.5);
            raise_sliding();
        } else {
            raise_from_each({positions_, limits_, movement_.movable}, raised);
        }
        budget_.context().report("max-min", 0.88, "the best goes on");
        go_on(first);
    }

    /// Ends at the best of the results.
    void raise_from_each(const Start& slid, const Start& raised) {
        const int starts = count_starts();
        std::optional<Start> best;
        MeshMeasure reached;
        for (int i = 0; i < starts && !budget_.exhausted(); ++i) {
            budget_.context().report("max-min", 0.4 + 0.48 * i / starts,
                                     fmt::format("{} of {}", i + 1, starts));
            order_ = i < 2 ? RaiseOrder::worst : RaiseOrder::parts_first;
            vertices_first_ = i == 1 || i == 2; // so that two starts have both orders
            begin_at(i % 2 == 0 ? slid : raised);
            raise_sliding();
            const MeshMeasure now = measure_mesh(mesh_, positions_, budget_.parallel());
            if (best && !now.is_better_than(reached)) continue;
            reached = now;
            best = Start{positions_, limits_, movement_.movable};
        }
        if (best) begin_at(*best);
    }

    /// Every attempt that violates the limits of the boundary leaves them narrower, for good; in the end no
    /// vertex round the worst cells can move. So the best state gets those of the start again, and the worst
    /// cells are raised together, then place by place in turn, as long as one of the two helps.
    void go_on(const FirstLimits& first) {
        if (!options_.max_min) return;
        if (options_.max_deviation_rel > 0) let_corners_move();
        const Start before{positions_, limits_, movement_.movable};
        take_turns(first, raise_work());
        if (options_.max_deviation_rel > 0 && guard_ && engine_.knows_face_limits())
            go_on_with_faces(before, first);
    }

    /// Once more with limits on the faces instead of the single vertices. Where cells are still bad, vertices
    /// have pressed against their limits into places that are hard to leave: from the state before, and for
    /// longer.
    void go_on_with_faces(const Start& before, const FirstLimits& first) {
        faces_.emplace(guard_->faces());
        movement_.faces = &*faces_;
        const bool is_bad = !bad_cells().empty();
        if (is_bad) {
            begin_at(before);
            movement_.band = band_;
        }
        take_turns(first, (is_bad ? kBadFaceWork : kFaceWork) * raise_work());
        movement_.faces = nullptr;
    }

    void take_turns(const FirstLimits& first, double work) {
        const auto least = [&] { return measure_mesh(mesh_, positions_, budget_.parallel()).min_sj; };
        work_left_ = work;
        order_ = RaiseOrder::worst;
        double now = least();
        const int orders = engine_.takes_parts() ? 2 : 1;
        float share = 1; // of the limits
        for (int in_vain = 0; in_vain < orders && work_left_ > 0 && !budget_.exhausted();) {
            const double before = now;
            limits_.reach = first.reach;
            limits_.band_share = first.band_share;
            for (float& reach : limits_.reach) reach *= share;
            for (float& band : limits_.band)
                if (band > 0) band = share * static_cast<float>(band_);
            raise_worst();
            if (!is_within_deviation()) {
                positions_ = mesh_.positions; // the best that is
                share *= kNarrowerAgain;
            }
            now = least();
            in_vain = now > before + kWorthRenewing ? 0 : in_vain + 1;
            if (orders > 1)
                order_ = order_ == RaiseOrder::worst ? RaiseOrder::parts_first : RaiseOrder::worst;
        }
    }

    void begin_at(const Start& start) {
        positions_ = start.positions;
        limits_ = start.limits;
        movement_.movable = start.movable;
        movement_.band = 0;
    }

    int count_starts() const {
        if (!options_.max_min || mesh_.cell_count() > kMoreStartsUpTo) return 1;
        const bool has_orders = engine_.takes_parts() || engine_.raises_vertices();
        return std::min(options_.starts, has_orders ? 4 : 2);
    }

    /// A state beyond the deviation that the user admits is no result, however good; but steps go on from it:
    /// the guard, which looks at some places only, with a margin, let them.
    void keep_if_within() {
        if (is_within_deviation()) keep_if_better_();
    }

    bool is_within_deviation() {
        if (!guard_ || !(options_.max_deviation_rel > 0) ||
            guard_->is_within(positions_, kSurelyWithin / kGuardMargin, budget_.parallel()))
            return true;
        HexMesh moved = mesh_;
        moved.positions = positions_;
        const auto deviation = measure_deviation(moved, topology_, *surface_, {}, budget_.context());
        return deviation && deviation->largest() <= most_deviation_;
    }

    /// Max-min on the surface, then in the band.
    void raise_sliding() {
        raise_worst();
        if (!(options_.max_deviation_rel > 0) || budget_.exhausted()) return;
        let_corners_move();
        raise_worst();
    }

    /// Single vertices give most of the rise for little, where engines raise them; but those that slide leave
    /// the neighbourhoods less to rise by then than the other way round.
    void raise_worst() {
        if (!options_.max_min) return;
        const bool has_vertices = engine_.raises_vertices();
        if (has_vertices && vertices_first_) raise_vertices();
        raise_neighbourhoods();
        if (has_vertices && !vertices_first_ && raise_vertices()) raise_neighbourhoods();
    }

    /// Of one call of max-min at most.
    double raise_work() const {
        const bool quick = options_.effort == Effort::quick;
        const double per_cell = quick ? kQuickWorkPerCell : max_min::kWorkPerCell;
        const double at_least = quick               ? kQuickWorkAtLeast
                                : movement_.surface ? kSlidingWorkAtLeast / (count_starts() > 1 ? 2 : 1)
                                                    : max_min::kWorkAtLeast;
        return engine_.speed() * (at_least + per_cell * static_cast<double>(mesh_.cell_count()));
    }

    void raise_neighbourhoods() {
        const bool quick = options_.effort == Effort::quick;
        const MaxMinResult result = raise_worst_cells(movement_, engine_, positions_, eps_, options_.min_sj,
                                                      std::min(raise_work(), work_left_),
                                                      quick ? RaiseOrder::parts : order_, budget_);
        work_left_ -= result.work;
        stats_.newton_steps += result.newton_steps;
        stats_.cg_iterations += result.cg_iterations;
        keep_if_within();
    }

    /// False: none has moved.
    bool raise_vertices() {
        const std::vector<Point> start = positions_;
        const SurfaceLimits limits = limits_;
        for (int narrowing = 0; narrowing <= kRaiseNarrowings && !budget_.exhausted(); ++narrowing) {
            const std::vector<Point> before = positions_;
            Problem problem(mesh_, topology_, movement_.movable, movement_.tets, movement_.inverse_stretch,
                            budget_.parallel());
            std::optional<SurfaceMotion> motion;
            if (movement_.surface) motion.emplace(problem, *surface_, limits_, movement_.tangents);
            const auto minimiser = engine_.open(problem, positions_, motion ? &*motion : nullptr);
            minimiser->update_lengths();
            stats_.sweeps += minimiser->raise_vertices(std::min(options_.min_sj, max_min::kPerfect));
            const std::vector<Index> violators =
                movement_.guard
                    ? guard_->violators(positions_, boundary_among(movement_.movable), budget_.parallel())
                    : std::vector<Index>{};
            if (violators.empty()) break;
            if (narrowing < kRaiseNarrowings)
                guard_->tighten(positions_, violators, kNarrower, limits_);
            else
                limits_ = limits;
            positions_ = before;
        }
        keep_if_within();
        return positions_ != start;
    }

    void untangle_interior() {
        movement_.movable.resize(mesh_.vertex_count());
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
            movement_.movable[v] = !topology_.on_boundary[v];
        Problem problem(mesh_, topology_, movement_.movable, movement_.tets, movement_.inverse_stretch,
                        budget_.parallel());
        const auto newton = engine_.open(problem, positions_, nullptr);
        newton->update_lengths();
        const auto count_bad = [&] {
            const auto cells = newton->measure();
            return std::count_if(cells.begin(), cells.end(),
                                 [](const CellMeasure& c) { return c.has_bad32; });
        };
        if (const auto bad = count_bad(); bad > 0) {
            const std::vector<Point> before = positions_;
            stats_.cg_iterations += newton->start_harmonically(topology_.on_boundary);
            if (count_bad() >= bad) positions_ = before;
        }
        finish_untangling(*newton);
    }

    void finish_untangling(Minimiser& newton, int max_rounds = kMaxUntangleRounds, double size_weight = 0) {
        const UntangleResult result = untangle_regularised(newton, max_rounds, budget_, size_weight);
        stats_.newton_steps += result.newton_steps;
        stats_.cg_iterations += result.cg_iterations;
        eps_ = result.eps;
    }

    /// Mends what is poor, boundary included, and leaves the rest of the mesh alone. The interior by itself
    /// only where that fails.
    void slide_where_needed() {
        budget_.context().report("slide", 0.02);
        set_up_sliding(positions_);
        std::vector<Index> poor =
            find_poor_cells(mesh_, positions_, movement_.inverse_stretch, kPoorEnergy, budget_.parallel());
        if (const auto finished = options_.finished_cells; !finished.empty()) {
            const std::vector<Index> bad = bad_cells();
            std::erase_if(
                poor, [&](Index c) { return finished[c] && !std::binary_search(bad.begin(), bad.end(), c); });
        }
        budget_.context().log(LogLevel::debug, fmt::format("{} poor cells", poor.size()));
        slide(movable_neighbourhood(mesh_, topology_, movement_.movable, poor, kPoorRings));
        keep_if_within();
        if (options_.fresh_boundary || bad_cells().empty() || budget_.exhausted()) return;
        const std::vector<std::uint8_t> sliding = movement_.movable;
        untangle_interior();
        movement_.movable = sliding;
        keep_if_within();
    }

    /// sound: the boundary where it is now round the soundest cells known, whose sizes tell how far a vertex
    /// may slide. Once a run.
    void set_up_sliding(std::span<const Point> sound) {
        if (options_.fresh_boundary && positions_ != mesh_.positions) unmoved_ = positions_;
        const double diagonal = surface_->diagonal();
        const double deviation =
            (options_.max_deviation_rel > 0 ? options_.max_deviation_rel : kSlidingDeviationRel) * diagonal;
        if (!options_.fresh_boundary)
            limits_ =
                compute_surface_limits(mesh_, topology_, *surface_, sound, deviation, budget_.parallel());
        else if (options_.max_deviation_rel > 0)
            limits_ = unlimited_on_surface(positions_); // bands may open
        const auto bound = surface_->associations();
        movement_.movable.resize(mesh_.vertex_count());
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
            movement_.movable[v] = bound[v].kind == EntityKind::interior ||
                                   bound[v].kind == EntityKind::patch || bound[v].kind == EntityKind::curve;
        movement_.surface = surface_;
        movement_.limits = &limits_;
        movement_.tangents = options_.fresh_boundary ? Tangents::exact : Tangents::smooth;
        if (!options_.fresh_boundary) {
            guard_.emplace(mesh_, topology_, *surface_, limits_, kGuardMargin * deviation,
                           budget_.parallel());
            movement_.guard = &*guard_;
        }
        band_ = kBandShare * options_.max_deviation_rel * diagonal;
        if (guard_ && band_ > 0) {
            const auto start = measure_deviation(mesh_, topology_, *surface_, {}, budget_.context());
            most_deviation_ = std::max(deviation, start ? kStartMargin * start->largest() : 0);
        }
    }

    void slide(const std::vector<std::uint8_t>& moving) {
        if (const auto bad = slide_within_deviation(moving); !bad.empty() && band_ > 0) {
            let_corners_move();
            open_bands(movement_, bad);
            slide_within_deviation(movement_.movable);
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

    /// Slides the vertices named by `moving`; where quads then deviate too far, narrows the limits and goes
    /// on round them. Returns the cells that stay bad.
    std::vector<Index> slide_within_deviation(std::vector<std::uint8_t> moving) {
        if (!guard_) {
            slide_vertices(moving, 0);
            return bad_cells();
        }
        const std::vector<Point> before = positions_;
        for (int narrowing = 0; narrowing < kMaxNarrowings && !budget_.exhausted(); ++narrowing) {
            slide_vertices(moving, narrowing);
            const std::vector<Index> violators =
                guard_->violators(positions_, boundary_among(moving), budget_.parallel());
            if (violators.empty()) return bad_cells();
            budget_.context().log(LogLevel::debug, fmt::format("{} vertices deviate", violators.size()));
            const bool freeze = narrowing >= kFreezeAfter;
            guard_->tighten(positions_, violators, freeze ? 0 : kNarrower, limits_);
            guard_->pull_back(positions_, violators);
            if (freeze)
                for (Index v : violators) movement_.movable[v] = 0;
            moving = movable_neighbourhood(mesh_, topology_, movement_.movable, cells_at(violators), 2);
        }
        positions_ = before;
        return bad_cells();
    }

    /// Untangles with the given vertices movable. Quick: the last rounds only round what is still bad.
    void slide_vertices(const std::vector<std::uint8_t>& moving, int narrowing) {
        const bool quick = options_.effort == Effort::quick && narrowing == 0;
        const bool sized = options_.fresh_boundary && engine_.keeps_sizes();
        untangle_sliding(moving, quick ? kQuickRounds : kMaxUntangleRounds, sized ? kSizeWeight : 0);
        if (!quick) return;
        const std::vector<Index> bad = bad_cells();
        if (bad.empty()) return;
        const std::vector<Point> before = positions_;
        untangle_sliding(movable_neighbourhood(mesh_, topology_, movement_.movable, bad, kPoorRings),
                         options_.fresh_boundary ? kFreshRounds : kMaxUntangleRounds,
                         sized ? kTangledSizeWeight : 0);
        if (bad_cells().size() > bad.size()) positions_ = before;
    }

    void untangle_sliding(const std::vector<std::uint8_t>& moving, int max_rounds, double size_weight) {
        Problem whole(mesh_, topology_, moving, movement_.tets, movement_.inverse_stretch,
                      budget_.parallel());
        std::vector<Problem> parts;
        if (engine_.takes_parts())
            parts = Problem::split(std::move(whole));
        else
            parts.push_back(std::move(whole));
        double eps = 0;
        for (Problem& part : parts) {
            SurfaceMotion motion(part, *surface_, limits_, movement_.tangents);
            if (size_weight > 0)
                part.update_lengths(unmoved_.empty() ? mesh_.positions : unmoved_, budget_.parallel());
            finish_untangling(*engine_.open(part, positions_, &motion), max_rounds, size_weight);
            eps = std::max(eps, eps_);
        }
        eps_ = eps;
    }

    std::vector<Index> boundary_among(const std::vector<std::uint8_t>& moving) const {
        std::vector<Index> vertices;
        for (Index v : guard_->boundary_vertices())
            if (moving[v]) vertices.push_back(v);
        return vertices;
    }

    std::vector<Index> cells_at(const std::vector<Index>& vertices) const {
        std::vector<Index> cells;
        for (Index v : vertices)
            for (CellCorner corner : topology_.vertex_cell[v]) cells.push_back(corner.cell);
        std::sort(cells.begin(), cells.end());
        cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
        return cells;
    }

    std::vector<Index> bad_cells() const { return find_bad_cells(mesh_, positions_, budget_.parallel()); }

    const HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel* surface_;
    const OptimizeOptions& options_;
    Engine& engine_;
    std::vector<Point>& positions_;
    Budget& budget_;
    const std::function<void()>& keep_if_better_;
    OptimizeStats& stats_;
    std::vector<float> inverse_stretch_; ///< 3 a cell, empty for cubes
    Movement movement_;
    /// Positions that cells with a fresh boundary have their sizes from; empty: those of mesh_, which stay
    /// as they are until sliding has ended.
    std::vector<Point> unmoved_;
    SurfaceLimits limits_;
    std::optional<DeviationGuard> guard_;
    std::optional<LimitedFaces> faces_;
    double band_ = 0, most_deviation_ = 0;
    double eps_ = 1e-12;
    double work_left_ = std::numeric_limits<double>::infinity(); ///< of what go_on() may spend
    RaiseOrder order_ = RaiseOrder::worst;                       ///< of a thorough run
    bool vertices_first_ = true; ///< before the neighbourhoods, else after them and these again
};

} // namespace

void optimize_robust(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                     const OptimizeOptions& options, Engine& engine, std::vector<Point>& positions,
                     Budget& budget, const std::function<void()>& keep_if_better, OptimizeStats& stats) {
    RobustRun(mesh, topology, surface, options, engine, positions, budget, keep_if_better, stats).run();
}

} // namespace hexopt
