#include "pipeline/reach_features.hpp"

#include "pipeline/mesh_attempt.hpp"
#include "stages/optimize/reach_home.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kOff_rel = 1e-9; ///< of the diagonal: farther off a vertex counts as off
/// In mean edges at a vertex: how far from a corner it may be, how near counts as on it, and how near the
/// corner must lie to what the vertex is bound to.
constexpr double kReach = 1.3, kHit = 1e-3, kBeside = 0.01;
constexpr std::size_t kTries = 4; ///< vertices for a corner
/// Neighbourhoods that may be tried for corners that no vertex is on, and for vertices off their patches: so
/// many each, and one for so many cells.
constexpr std::size_t kTriesAtLeast = 50, kCellsPerTry = 250;

class FeatureReacher {
  public:
    FeatureReacher(FittedMesh& fitted, const Topology& topology, Domain& domain,
                   const ReachFeaturesOptions& options, Context& context)
        : fitted_(fitted), topology_(topology), domain_(domain), more_places_(options.more_places),
          context_(context),
          reacher_(fitted.mesh, topology, domain.model, {options.min_sj, options.time_limit_s}, context) {
        collect_surface();
    }

    ReachReport run() {
        ReachReport report;
        report.corners = domain_.model.corner_count();
        const std::vector<std::uint8_t> is_hit = find_hit_corners();
        report.corners_before = count_corners(is_hit);
        report.followed_before_rel = measure_followed();
        report.off_before = find_off(EntityKind::corner).size() + find_off(EntityKind::curve).size() +
                            find_off(EntityKind::patch).size();
        bring_home(EntityKind::corner, kUnlimited);
        bring_home(EntityKind::curve, kUnlimited);
        hit_corners();
        bring_home(EntityKind::patch, limited());
        if (report.off_before > 0) hit_corners(); // there may be room for more now
        report.corners_after = count_corners(find_hit_corners());
        report.followed_after_rel = measure_followed();
        report.off_after = find_off(EntityKind::corner).size() + find_off(EntityKind::curve).size() +
                           find_off(EntityKind::patch).size();
        return report;
    }

  private:
    std::size_t limited() const { return kTriesAtLeast + fitted_.mesh.cell_count() / kCellsPerTry; }
    static constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

    struct Candidate {
        double cost;
        Index corner, vertex;
        auto operator<=>(const Candidate&) const = default;
    };

    void collect_surface() {
        const HexMesh& mesh = fitted_.mesh;
        std::vector<double> sum(mesh.vertex_count(), 0), edges(mesh.vertex_count(), 0);
        for (const CellFace& face : topology_.boundary_faces) {
            const Quad quad = face_vertices(mesh, face);
            for (int k = 0; k < 4; ++k) {
                const Index a = quad[k], b = quad[(k + 1) % 4];
                const double length = glm::distance(mesh.positions[a], mesh.positions[b]);
                sum[a] += length, sum[b] += length;
                edges[a] += 1, edges[b] += 1;
            }
        }
        for (Index v = 0; v < edges.size(); ++v)
            if (edges[v] > 0) on_boundary_.push_back({v, sum[v] / edges[v]});
    }

    /// Vertices off what they are bound to, the nearest first.
    std::vector<Index> find_off(EntityKind kind) const {
        std::vector<std::pair<double, Index>> off;
        for (Index v = 0; v < fitted_.association.size(); ++v)
            if (fitted_.association[v].kind == kind)
                if (const double d = distance(v); d > kOff_rel * domain_.model.diagonal())
                    off.push_back({d, v});
        std::sort(off.begin(), off.end());
        std::vector<Index> vertices;
        for (const auto& [d, v] : off) vertices.push_back(v);
        return vertices;
    }

    double distance(Index v) const {
        return domain_.model.project(fitted_.association[v], fitted_.mesh.positions[v]).distance;
    }

    void bring_home(EntityKind kind, std::size_t most) {
        const std::vector<Index> off = find_off(kind);
        if (off.empty()) return;
        const std::size_t home = reacher_.reach(off, most);
        constexpr const char* kKinds[] = {"", "patches", "curves", "corners"};
        context_.log(LogLevel::debug, fmt::format("{} of {} vertices off their {} brought home", home,
                                                  off.size(), kKinds[static_cast<int>(kind)]));
    }

    double measure_followed() const {
        double all = 0, followed = 0;
        const BoundaryModel& model = domain_.model;
        for (Index c = 0; c < model.curve_count(); ++c) {
            const std::span<const Point> points = model.curve_points(c);
            for (std::size_t i = 1; i < points.size(); ++i) all += glm::distance(points[i - 1], points[i]);
        }
        const auto is_home = [&](Index v) { return distance(v) <= kOff_rel * model.diagonal(); };
        for (const FittedMesh::RidgeEdge& ridge : fitted_.ridges)
            if (is_home(ridge.a) && is_home(ridge.b))
                followed += glm::distance(fitted_.mesh.positions[ridge.a], fitted_.mesh.positions[ridge.b]);
        return all > 0 ? followed / all : 1;
    }

    static std::size_t count(const std::vector<std::uint8_t>& flags) {
        return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 1));
    }

    std::size_t count_corners(const std::vector<std::uint8_t>& is_hit) const {
        return static_cast<std::size_t>(std::count(
            is_hit.begin(), is_hit.begin() + static_cast<std::ptrdiff_t>(domain_.model.corner_count()), 1));
    }

    /// The domain's corners, then the other places.
    std::size_t place_count() const { return domain_.model.corner_count() + more_places_.size(); }
    const Point& place_of(std::size_t k) const {
        const std::size_t corners = domain_.model.corner_count();
        return k < corners ? domain_.model.corner_point(static_cast<Index>(k)) : more_places_[k - corners];
    }

    std::vector<std::uint8_t> find_hit_corners() const {
        std::vector<std::uint8_t> is_hit(place_count(), 0);
        context_.parallel().for_each(is_hit.size(), 1, [&](std::size_t k) {
            const Point& place = place_of(k);
            for (const auto& [v, size] : on_boundary_)
                if (glm::distance(place, fitted_.mesh.positions[v]) < kHit * size) is_hit[k] = 1;
        });
        return is_hit;
    }

    /// Vertices for each corner that none is on, the cheapest first.
    std::vector<Candidate> find_candidates() const {
        const BoundaryModel& model = domain_.model;
        const std::vector<std::uint8_t> is_hit = find_hit_corners();
        std::vector<std::vector<Candidate>> of(is_hit.size());
        context_.parallel().for_each(is_hit.size(), 1, [&](std::size_t k) {
            const Point& place = place_of(k);
            for (const auto& [v, size] : on_boundary_) {
                const double way = glm::distance(place, fitted_.mesh.positions[v]) / size;
                const Association on = fitted_.association[v];
                if (is_hit[k] || way > kReach) continue;
                if (on.kind != EntityKind::patch && on.kind != EntityKind::curve) continue;
                if (model.project(on, place).distance > kBeside * size) continue;
                of[k].push_back({way, static_cast<Index>(k), v});
            }
            std::sort(of[k].begin(), of[k].end());
            if (of[k].size() > kTries) of[k].resize(kTries);
        });
        std::vector<Candidate> all;
        for (const std::vector<Candidate>& some : of) all.insert(all.end(), some.begin(), some.end());
        std::sort(all.begin(), all.end());
        return all;
    }

    /// In turns: each corner's cheapest vertex that is left and that no other corner gets.
    void hit_corners() {
        std::vector<Candidate> left = find_candidates();
        std::vector<std::uint8_t> is_hit(place_count(), 0), is_used(fitted_.association.size(), 0);
        std::size_t most = limited();
        while (!left.empty() && most > 0 && !context_.is_cancelled()) {
            std::vector<Candidate> chosen, rest;
            std::vector<std::uint8_t> has_turn = is_hit, is_taken = is_used;
            for (const Candidate& c : left) {
                if (is_hit[c.corner] || is_used[c.vertex]) continue;
                const bool now = !has_turn[c.corner] && !is_taken[c.vertex];
                (now ? chosen : rest).push_back(c);
                if (now) has_turn[c.corner] = is_taken[c.vertex] = 1;
            }
            std::vector<HomeReacher::Place> places;
            for (const Candidate& c : chosen) places.push_back({c.vertex, place_of(c.corner)});
            const std::vector<std::uint8_t> is_there = reacher_.put(places, most);
            for (std::size_t i = 0; i < chosen.size(); ++i) {
                if (!is_there[i]) continue;
                is_hit[chosen[i].corner] = is_used[chosen[i].vertex] = 1;
                if (chosen[i].corner < domain_.model.corner_count())
                    fitted_.association[chosen[i].vertex] = {EntityKind::corner, chosen[i].corner};
            }
            left.swap(rest);
        }
        free_from_corners(is_hit);
        context_.log(LogLevel::debug, fmt::format("{} corners hit that were missed", count(is_hit)));
    }

    /// Binds vertices that are off corners which others hit to the curve that they follow, or else to the
    /// nearest patch.
    void free_from_corners(const std::vector<std::uint8_t>& is_hit) {
        const BoundaryModel& model = domain_.model;
        for (Index v : find_off(EntityKind::corner)) {
            Association& on = fitted_.association[v];
            if (!is_hit[on.entity]) continue;
            const auto ridge =
                std::find_if(fitted_.ridges.begin(), fitted_.ridges.end(),
                             [&](const FittedMesh::RidgeEdge& r) { return r.a == v || r.b == v; });
            if (ridge != fitted_.ridges.end())
                on = {EntityKind::curve, ridge->curve};
            else
                on = {EntityKind::patch,
                      model.patch_of_triangle(
                          model.project_patch(kNoIndex, fitted_.mesh.positions[v]).element)};
        }
        bind_surface(domain_, fitted_);
    }

    FittedMesh& fitted_;
    const Topology& topology_;
    Domain& domain_;
    const std::vector<Point>& more_places_;
    Context& context_;
    HomeReacher reacher_;
    std::vector<std::pair<Index, double>> on_boundary_; ///< vertices, and the mean of their edges there
};

} // namespace

Result<ReachReport> reach_features(FittedMesh& fitted, const Topology& topology, Domain& domain,
                                   const ReachFeaturesOptions& options, Context& context) {
    const ReachReport report = FeatureReacher(fitted, topology, domain, options, context).run();
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "settle", "", "cancelled");
    return report;
}

} // namespace hexopt
