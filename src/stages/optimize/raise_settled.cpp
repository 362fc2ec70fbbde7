#include "stages/optimize/boundary_contacts.hpp"
#include "stages/optimize/max_min.hpp"
#include "stages/optimize/mesh_measure.hpp"
#include "stages/optimize/retreat.hpp"

namespace hexopt {

namespace {

constexpr double kValidEps = 1e-12;
/// Farther from what they are bound to than this, relative to the diagonal, vertices count as off it.
constexpr double kOff_rel = 1e-9;
/// How near sliding may bring quads to one another that are apart, relative to the diagonal: tells which are
/// watched.
constexpr double kWatched_rel = 0.005;
/// Vertices that are off are free up to where they are: SurfaceMotion's share of their range.
constexpr double kFreeShare = 0.8;
constexpr double kQuickWorkPerCell = 8, kQuickWorkAtLeast = 1e5;
/// Low cells are worth so many times the work, as long as they are no more than a share of all: where there
/// are more, most of them cannot rise.
constexpr double kLowWork = 5, kFewLow = 3e-3;

/// Lets nothing touch that did not at the start.
class ContactWatch final : public BoundaryGuard {
  public:
    ContactWatch(const HexMesh& mesh, const Topology& topology, double distance, const Parallel& parallel)
        : quads_(mesh, topology, kTouching), guard_(mesh, topology, quads_.quads(), quads_.vertex_quad(),
                                                    mesh.positions, distance, parallel, kClearance) {}

    std::vector<Index> violators(std::span<const Point> positions, std::span<const Index> vertices,
                                 const Parallel& parallel) const override {
        std::vector<Index> moved, found;
        for (Index v : vertices) {
            const auto quads = quads_.vertex_quad()[v];
            moved.insert(moved.end(), quads.begin(), quads.end());
        }
        make_unique(moved);
        for (Index q : guard_.touching(positions, moved, parallel))
            found.insert(found.end(), quads_.quad(q).begin(), quads_.quad(q).end());
        make_unique(found);
        return found;
    }

  private:
    /// Above what counts as contact in the end.
    static constexpr ContactLimits kClearance{5e-3, 0.02};

    static void make_unique(std::vector<Index>& items) {
        std::sort(items.begin(), items.end());
        items.erase(std::unique(items.begin(), items.end()), items.end());
    }

    BoundaryContacts quads_;
    ContactGuard guard_;
};

} // namespace

Result<OptimizeStats> raise_settled(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                                    const OptimizeOptions& options, Context& context) {
    Budget budget(options, context);
    OptimizeStats stats;
    const MeshMeasure before = measure_mesh(mesh, mesh.positions, context.parallel());
    SurfaceLimits limits = unlimited_on_surface(mesh.positions);
    const auto bound = surface.associations();
    Movement movement;
    movement.mesh = &mesh;
    movement.topology = &topology;
    movement.surface = &surface;
    movement.limits = &limits;
    movement.tangents = Tangents::exact;
    movement.movable.resize(mesh.vertex_count());
    context.parallel().for_each(mesh.vertex_count(), 1024, [&](std::size_t v) {
        const EntityKind kind = bound[v].kind;
        movement.movable[v] = kind != EntityKind::hanging && kind != EntityKind::corner;
        if (kind == EntityKind::interior || kind == EntityKind::hanging) return;
        const double distance = surface.project(bound[v], mesh.positions[v]).distance;
        if (!(distance > kOff_rel * surface.diagonal())) return;
        movement.movable[v] = 1;
        limits.band[v] = static_cast<float>(distance / kFreeShare);
    });
    const ContactWatch watch(mesh, topology, kWatched_rel * surface.diagonal(), context.parallel());
    movement.guard = &watch;
    const bool quick = options.effort == Effort::quick;
    const double work =
        (quick ? kQuickWorkAtLeast : max_min::kWorkAtLeast) +
        (quick ? kQuickWorkPerCell : max_min::kWorkPerCell) * static_cast<double>(mesh.cell_count());
    std::vector<Point> positions = mesh.positions;
    HostEngine host(budget);
    const auto raise = [&](double to, double with) {
        const MaxMinResult result = raise_worst_cells(movement, host, positions, kValidEps, to, with,
                                                      quick ? RaiseOrder::parts : RaiseOrder::worst, budget);
        stats.newton_steps += result.newton_steps;
        stats.cg_iterations += result.cg_iterations;
    };
    if (quick && static_cast<double>(before.low) < kFewLow * static_cast<double>(mesh.cell_count()))
        raise(std::min(kLowScaledJacobian, options.min_sj), kLowWork * work);
    raise(options.min_sj, work);
    const MeshMeasure reached = measure_mesh(mesh, positions, context.parallel());
    stats.restored_input = !(reached.is_not_worse_than(before) && reached.is_better_than(before));
    if (!stats.restored_input) mesh.positions = std::move(positions);
    const MeshMeasure& after = stats.restored_input ? before : reached;
    stats.bad8_before = before.bad8, stats.bad8_after = after.bad8;
    stats.bad32_before = before.bad32, stats.bad32_after = after.bad32;
    stats.min_sj_before = before.min_sj, stats.min_sj_after = after.min_sj;
    stats.seconds = budget.seconds();
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "optimize", "",
                          "cancelled; the best state so far is kept in memory");
    return stats;
}

} // namespace hexopt
