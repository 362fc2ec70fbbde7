#include "stages/optimize/thesis.hpp"

#include "stages/optimize/thesis_sweeps.hpp"
#include "stages/optimize/untangle.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

// The counts printed with Algorithm 3.
constexpr int kExternal = 2, kSmoothUntangle = 10, kOptimiseUntangle = 10, kOptimise = 10, kFinal = 5;

/// Rings of cells round the bad ones whose vertices move in a cluster.
constexpr int kClusterRings = 2;

class ThesisRun {
  public:
    ThesisRun(const HexMesh& mesh, const Topology& topology, const OptimizeOptions& options,
              std::vector<Point>& positions, Budget& budget, const std::function<void()>& keep_if_better,
              OptimizeStats& stats)
        : mesh_(mesh), topology_(topology), options_(options), positions_(positions), budget_(budget),
          keep_if_better_(keep_if_better), stats_(stats), energy_(resolved_energy(options)),
          movable_(inner_vertices(topology)), sweeps_(mesh, topology, movable_, positions, budget),
          tets_(tets_of(options.decomposition)) {
        for (std::uint32_t mode : {kCornerTets, kPathTets})
            if (tets_ & mode) modes_.push_back(mode);
    }

    /// Algorithm 3.
    void run() {
        for (int external = 0; external < kExternal; ++external) {
            const std::size_t before = concave();
            if (before == 0 || budget_.exhausted()) break;
            report("untangle", 0.02 + 0.4 * external);
            smooth_and_untangle();
            for (std::uint32_t mode : modes_) {
                report("optimize", 0.1 + 0.4 * external);
                if (concave() > 0) optimise_and_untangle(mode);
            }
            if (is_improved() && concave() > 0) untangle_clusters();
            keep_if_better_();
            if (concave() >= before) break;
        }
        report("optimize", 0.9);
        // One decomposition's optimum may turn over tetrahedra of the other: improved, both count at once.
        const std::vector<std::uint32_t> last =
            is_improved() ? std::vector<std::uint32_t>(modes_.size(), tets_) : modes_;
        for (std::uint32_t mode : last) {
            if (sweeps_.find_min_sj() >= options_.min_sj) break;
            optimise(mode, kFinal);
            keep_if_better_();
        }
    }

  private:
    static std::vector<std::uint8_t> inner_vertices(const Topology& topology) {
        std::vector<std::uint8_t> movable(topology.on_boundary.size());
        for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !topology.on_boundary[v];
        return movable;
    }

    /// Beyond the print: smart Laplacian smoothing and clusters (4.6 asks for the former, fig. 4.21 the
    /// latter).
    bool is_improved() const { return options_.untangle == UntangleTarget::deepest_point; }

    std::size_t concave() const { return sweeps_.count_concave(tets_); }

    void report(const char* stage, double fraction) { budget_.context().report(stage, fraction); }

    /// "Until no concave cells remain or no cells are untangled at the last sweep."
    void untangle(std::uint32_t mode) {
        std::size_t before = sweeps_.count_concave(mode);
        while (before > 0 && !budget_.exhausted()) {
            ++stats_.sweeps;
            if (sweeps_.untangle(mode, options_.untangle) == 0) break;
            const std::size_t now = sweeps_.count_concave(mode);
            if (now >= before) break;
            before = now;
        }
    }

    void untangle_all() {
        for (std::uint32_t mode : modes_) untangle(mode);
    }

    /// As printed: disturb, then untangle. Improved: untangle first; plain smoothing only where it pays, else
    /// the smart one, else neither.
    void smooth_and_untangle() {
        if (is_improved()) untangle_all();
        for (int i = 0; i < kSmoothUntangle && !budget_.exhausted(); ++i) {
            const std::size_t before = concave();
            if (before == 0) break;
            const std::vector<Point> start = positions_;
            disturb_and_untangle(false);
            std::size_t now = concave();
            if (is_improved() && now >= before) {
                positions_ = start;
                disturb_and_untangle(true);
                now = concave();
                if (now >= before) positions_ = start;
            }
            keep_if_better_();
            log("smoothing and untangling", i, before, now);
            if (now == before || (is_improved() && now > before)) break;
        }
        keep_if_better_();
    }

    void disturb_and_untangle(bool smart) {
        sweeps_.smooth(sweeps_.find_concave(tets_), smart);
        ++stats_.sweeps;
        untangle_all();
    }

    void optimise_and_untangle(std::uint32_t mode) {
        for (int i = 0; i < kOptimiseUntangle && !budget_.exhausted(); ++i) {
            const std::size_t before = concave();
            const std::vector<Point> start = positions_;
            optimise(mode, kOptimise);
            untangle_all();
            keep_if_better_();
            const std::size_t now = concave();
            if (is_improved() && now > before) positions_ = start;
            log(mode == kCornerTets ? "8-tet optimization" : "24-tet optimization", i, before, now);
            if (now == 0 || now == before || (is_improved() && now > before)) break;
        }
    }

    void optimise(std::uint32_t mode, int iterations) {
        // The regularisation falls with the worst tetrahedron, as in untangle_regularised().
        const double least = sweeps_.find_least_jacobian(mode);
        const LocalEnergy energy{energy_, least > 0 ? 1e-9 : std::clamp(0.2 * -least, 1e-3, 0.1)};
        for (int i = 0; i < iterations && !budget_.exhausted(); ++i, ++stats_.sweeps)
            if (energy_ == Energy::hyperelastic)
                sweeps_.step_jacobi(mode, energy, 0.5);
            else
                sweeps_.optimise(mode, energy, options_.gradient);
    }

    /// Vertices that block each other (fig. 4.21): all of a cluster at once, with the regularised energy.
    void untangle_clusters() {
        const std::vector<Point> before = positions_;
        const std::size_t bad = concave();
        std::vector<std::uint8_t> cells = sweeps_.find_concave(tets_), moving(mesh_.vertex_count(), 0);
        for (int ring = 0; ring < kClusterRings; ++ring) {
            std::vector<std::uint8_t> wider = cells;
            for (std::size_t c = 0; c < cells.size(); ++c)
                if (cells[c])
                    for (Index v : mesh_.cells[c])
                        for (CellCorner corner : topology_.vertex_cell[v]) wider[corner.cell] = 1;
            cells.swap(wider);
        }
        for (std::size_t c = 0; c < cells.size(); ++c)
            if (cells[c])
                for (Index v : mesh_.cells[c]) moving[v] = movable_[v];
        Problem problem(mesh_, topology_, moving);
        Newton newton(problem, positions_, nullptr, budget_);
        const UntangleResult result = untangle_regularised(newton, kMaxUntangleRounds, budget_);
        stats_.newton_steps += result.newton_steps;
        stats_.cg_iterations += result.cg_iterations;
        const std::size_t now = concave();
        log("cluster untangling", 0, bad, now);
        if (now >= bad) positions_ = before;
    }

    void log(const char* step, int iteration, std::size_t before, std::size_t now) const {
        budget_.context().log(LogLevel::debug, fmt::format("{} {}: {} -> {} concave cells, {} sweeps so far",
                                                           step, iteration + 1, before, now, stats_.sweeps));
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    const OptimizeOptions& options_;
    std::vector<Point>& positions_;
    Budget& budget_;
    const std::function<void()>& keep_if_better_;
    OptimizeStats& stats_;
    Energy energy_;
    std::vector<std::uint8_t> movable_;
    LocalSweeps sweeps_;
    std::uint32_t tets_;               ///< all modes together
    std::vector<std::uint32_t> modes_; ///< 8-tet, 24-tet, or one after the other
};

} // namespace

void optimize_thesis(const HexMesh& mesh, const Topology& topology, const OptimizeOptions& options,
                     std::vector<Point>& positions, Budget& budget,
                     const std::function<void()>& keep_if_better, OptimizeStats& stats) {
    ThesisRun(mesh, topology, options, positions, budget, keep_if_better, stats).run();
}

} // namespace hexopt
