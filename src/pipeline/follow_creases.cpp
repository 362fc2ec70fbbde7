#include "pipeline/follow_creases.hpp"

#include "domain/closest_point.hpp"
#include "domain/surface_creases.hpp"
#include "quality/cell_quality.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

constexpr double kOff_rel = 1e-7; ///< of the diagonal: farther from what it is bound to a vertex was let off
/// Edges of the surface that turn by less do not count, degrees.
constexpr double kLeastTurn_deg = 3;
/// How far a vertex may go, in lengths of its shortest boundary edge.
constexpr double kReach = 1.1;
/// What it must leave of that edge.
constexpr double kLeastEdge = 0.4;
/// What a move must leave of the sum of the distances' squares, at most.
constexpr double kGain = 0.97;

class CreaseFollower {
  public:
    CreaseFollower(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                   const FollowOptions& options, Context& context)
        : mesh_(mesh), topology_(topology), model_(model), options_(options), context_(context),
          limit_(options.distance_rel * model.diagonal()),
          creases_(find_patch_creases(model, kLeastTurn_deg * std::numbers::pi / 180, 0)) {
        collect_surface();
    }

    Result<FollowReport> run() {
        FollowReport report;
        measure(report.far_before, report.largest_before_rel);
        for (int round = 0; round < options_.rounds; ++round) {
            const std::size_t before = report.moved;
            std::vector<Index> due = vertices_near_far_quads();
            std::erase_if(due, [&](Index v) { return is_done_[v] != 0; });
            for (Index v : due) is_done_[v] = 1;
            for (Index v : due) {
                if (context_.is_cancelled())
                    return make_error(ErrorCode::cancelled, "settle", "", "cancelled");
                report.moved += improve(v);
            }
            if (report.moved == before) break;
        }
        measure(report.far_after, report.largest_after_rel);
        return report;
    }

  private:
    void collect_surface() {
        const std::size_t count = mesh_.vertex_count();
        std::vector<std::vector<Index>> at(count);
        for (const CellFace& face : topology_.boundary_faces) {
            for (Index v : face_vertices(mesh_, face)) at[v].push_back(static_cast<Index>(quads_.size()));
            quads_.push_back(face_vertices(mesh_, face));
        }
        for (const std::vector<Index>& quads : at) {
            vertex_quad_.item.insert(vertex_quad_.item.end(), quads.begin(), quads.end());
            vertex_quad_.offset.push_back(vertex_quad_.item.size());
        }
        is_done_.assign(count, 0);
        is_held_.assign(count, 0);
        for (Index v : mesh_.hanging.vertex) is_held_[v] = 1;
        for (Index v : mesh_.hanging.master) is_held_[v] = 1;
        ridge_.resize(count);
        for (const auto& [a, b] : model_.feature_edges()) {
            ridge_[a].push_back(b);
            ridge_[b].push_back(a);
        }
        hint_.assign(quads_.size(), kNoIndex);
        distance_.assign(quads_.size(), 0);
    }

    double quad_distance(Index q) {
        std::array<Point, 4> x;
        for (int k = 0; k < 4; ++k) x[k] = mesh_.positions[quads_[q][k]];
        return model_.quad_deviation(x, kNoIndex, hint_[q]);
    }

    void measure(std::size_t& far, double& largest_rel) {
        context_.parallel().for_each(
            quads_.size(), 64, [&](std::size_t q) { distance_[q] = quad_distance(static_cast<Index>(q)); });
        far = static_cast<std::size_t>(
            std::count_if(distance_.begin(), distance_.end(), [&](double d) { return d > limit_; }));
        const auto largest = std::max_element(distance_.begin(), distance_.end());
        largest_rel = largest == distance_.end() ? 0 : *largest / model_.diagonal();
    }

    std::vector<Index> vertices_near_far_quads() const {
        std::vector<Index> vertices;
        for (std::size_t q = 0; q < quads_.size(); ++q)
            if (distance_[q] > limit_) vertices.insert(vertices.end(), quads_[q].begin(), quads_[q].end());
        for (const auto& [a, b] : model_.feature_edges())
            if (edge_distance(a, b) > limit_) vertices.insert(vertices.end(), {a, b});
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        return vertices;
    }

    /// How far a mesh edge between two vertices of one curve cuts across its bends.
    double edge_distance(Index a, Index b) const {
        const auto bound = model_.associations();
        const Association& on = bound[a].kind == EntityKind::curve ? bound[a] : bound[b];
        if (on.kind != EntityKind::curve) return 0;
        double largest = 0;
        Index hint = kNoIndex;
        for (double t : {0.25, 0.5, 0.75}) {
            const Projection at =
                model_.project(on, (1 - t) * mesh_.positions[a] + t * mesh_.positions[b], hint);
            hint = at.element;
            largest = std::max(largest, at.distance);
        }
        return largest;
    }

    /// Moves a vertex to the best of the places near it; whether it did.
    bool improve(Index v) {
        const Association on = model_.associations()[v];
        if (is_held_[v] || (on.kind != EntityKind::patch && on.kind != EntityKind::curve)) return false;
        const Point start = mesh_.positions[v];
        const Projection at = model_.project(on, start);
        if (at.distance > kOff_rel * model_.diagonal()) return false;
        std::vector<Point> places = on.kind == EntityKind::patch ? crease_places(at) : bends(at);
        for (std::size_t k = 0, whole = places.size(); k < whole; ++k)
            places.push_back(model_.project(on, 0.5 * (start + places[k]), at.element).point);
        const double shortest = shortest_edge(v), reach = kReach * shortest;
        std::erase_if(places, [&](const Point& p) {
            const double way = glm::distance(p, start);
            return way > reach || way < 1e-9 * model_.diagonal();
        });
        if (places.empty()) return false;
        Badness least = badness(v);
        std::vector<CellValidity> cells;
        for (const CellCorner& corner : topology_.vertex_cell[v])
            cells.push_back(compute_cell_validity(cell_points(mesh_, corner.cell)));
        Point best = start;
        for (const Point& p : places) {
            mesh_.positions[v] = p;
            const Badness now = badness(v);
            if (now.is_better(least) && shortest_edge(v) >= kLeastEdge * shortest && keeps_cells(v, cells))
                least = now, best = p;
        }
        mesh_.positions[v] = best;
        if (best == start) return false;
        for (Index q : vertex_quad_[v]) {
            distance_[q] = quad_distance(q);
            for (Index u : quads_[q]) is_done_[u] = 0;
        }
        return true;
    }

    /// Closest points of the creases round the triangle that a vertex lies on, and their ends.
    std::vector<Point> crease_places(const Projection& at) const {
        std::vector<Point> places;
        for (Index c : creases_.of_triangle[at.element]) {
            const auto& [a, b] = creases_.ends[c];
            places.push_back(closest_on_segment(at.point, a, b).point);
            places.insert(places.end(), {a, b});
        }
        return places;
    }

    std::vector<Point> bends(const Projection& at) const {
        const auto& ends = model_.segment(at.element);
        return {ends[0], ends[1]};
    }

    double shortest_edge(Index v) const {
        double shortest = std::numeric_limits<double>::infinity();
        for (Index q : vertex_quad_[v])
            for (int k = 0; k < 4; ++k) {
                const Index a = quads_[q][k], b = quads_[q][(k + 1) % 4];
                if (a == v || b == v)
                    shortest = std::min(shortest, glm::distance(mesh_.positions[a], mesh_.positions[b]));
            }
        return shortest;
    }

    /// How far quads and edges at a vertex are from what they stand for.
    struct Badness {
        double sum = 0, largest = 0; ///< squared distances of places on them
        void add(double distance) {
            sum += distance * distance;
            largest = std::max(largest, distance * distance);
        }
        bool is_better(const Badness& than) const {
            return sum < kGain * than.sum && largest <= 1.05 * than.largest;
        }
    };

    Badness badness(Index v) {
        Badness all;
        for (Index q : vertex_quad_[v]) {
            std::array<Point, 4> x;
            for (int k = 0; k < 4; ++k) x[k] = mesh_.positions[quads_[q][k]];
            const auto add = [&](const Point& p) {
                const Projection at = model_.project_patch(kNoIndex, p, hint_[q]);
                hint_[q] = at.element;
                all.add(at.distance);
            };
            add(quad_centre(x));
            for (int k = 0; k < 4; ++k) add(0.5 * (x[k] + x[(k + 1) % 4]));
        }
        for (Index u : ridge_[v]) all.add(edge_distance(v, u));
        return all;
    }

    bool keeps_cells(Index v, const std::vector<CellValidity>& before) const {
        for (std::size_t k = 0; k < before.size(); ++k) {
            const CellValidity now =
                compute_cell_validity(cell_points(mesh_, topology_.vertex_cell[v][k].cell));
            if (!now.is_usable() ||
                now.scaled_jacobian < std::min(before[k].scaled_jacobian, options_.min_sj))
                return false;
        }
        return true;
    }

    HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel& model_;
    const FollowOptions& options_;
    Context& context_;
    double limit_; ///< model units
    PatchCreases creases_;
    std::vector<Quad> quads_;               ///< of the boundary
    Csr<Index> vertex_quad_;                ///< per vertex of the mesh
    std::vector<double> distance_;          ///< per quad, model units
    std::vector<Index> hint_;               ///< per quad
    std::vector<std::vector<Index>> ridge_; ///< per vertex: other ends of its feature edges
    std::vector<std::uint8_t> is_held_;     ///< per vertex: hangs, or others hang on it
    std::vector<std::uint8_t> is_done_;     ///< per vertex: tried since its quads changed
};

} // namespace

Result<FollowReport> follow_creases(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                    const FollowOptions& options, Context& context) {
    return CreaseFollower(mesh, topology, model, options, context).run();
}

} // namespace hexopt
