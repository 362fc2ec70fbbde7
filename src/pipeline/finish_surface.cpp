#include "pipeline/finish_surface.hpp"

#include "pipeline/follow_creases.hpp"
#include "pipeline/undo_contacts.hpp"

#include "stages/optimize/mesh_measure.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// Moves boundary vertices onto creases and bends that quads and edges would cut across.
Status follow(MeshAttempt& settled, const BoundaryModel& model, const MeshOptions& options, StageClock& clock,
              Context& context) {
    FollowOptions following;
    following.distance_rel = following.search_rel = options.refine.chord_error_rel;
    following.edge_rel = 0.5 * options.refine.chord_error_rel;
    following.min_sj = std::min(following.min_sj, options.optimize.min_sj);
    HexMesh& mesh = settled.fitted.mesh;
    const std::vector<Point> before = mesh.positions;
    const auto report = clock.run(
        "creases", [&] { return follow_creases(mesh, settled.topology, model, following, context); });
    if (!report) return report.error();
    const std::size_t back =
        undo_contacts(mesh, settled.topology, before, following.min_sj, context.parallel());
    context.log(LogLevel::debug,
                fmt::format("{} vertices moved onto creases and bends, {} of them went back for contacts: "
                            "quads farther off than {:.1g} of the "
                            "diagonal {} -> {}, the farthest {:.3g} -> {:.3g}",
                            report->moved, back, following.distance_rel, report->far_before,
                            report->far_after, report->largest_before_rel, report->largest_after_rel));
    return Done{};
}

std::vector<Point> find_corners_given_up(const BoundaryModel& whole, const BoundaryModel& left) {
    std::vector<Point> places;
    for (Index k = 0; k < whole.corner_count(); ++k) {
        const Point& place = whole.corner_point(k);
        bool is_left = false;
        for (Index other = 0; other < left.corner_count() && !is_left; ++other)
            is_left = left.corner_point(other) == place;
        if (!is_left) places.push_back(place);
    }
    return places;
}

} // namespace

Result<ReachReport> finish_surface(MeshAttempt& settled, const Domain& whole, Domain& domain,
                                   const MeshOptions& options, double time_limit_s, StageClock& clock,
                                   Context& context) {
    ReachFeaturesOptions reaching;
    const double least =
        measure_mesh(settled.fitted.mesh, settled.fitted.mesh.positions, context.parallel()).min_sj;
    reaching.min_sj = std::min(std::clamp(least, 0.1, 0.2), options.optimize.min_sj);
    reaching.time_limit_s = time_limit_s;
    reaching.more_places = find_corners_given_up(whole.model, domain.model);
    const auto reached = clock.run(
        "reach", [&] { return reach_features(settled.fitted, settled.topology, domain, reaching, context); });
    if (!reached) return reached.error();
    if (options.refine.chord_error_rel > 0)
        if (Status done = follow(settled, domain.model, options, clock, context); !done) return done.error();
    return *reached;
}

} // namespace hexopt
