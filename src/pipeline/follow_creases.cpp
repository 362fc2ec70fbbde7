#include "pipeline/follow_creases.hpp"

#include "domain/closest_point.hpp"
#include "domain/surface_creases.hpp"
#include "pipeline/surface_quads.hpp"
#include "quality/cell_quality.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <optional>

namespace hexopt {

namespace {

/// Edges of the surface that turn by less do not count, degrees.
constexpr double kLeastTurn_deg = 3;
/// How far a vertex may go, in lengths of its shortest boundary edge.
constexpr double kReach = 1.1;
/// What it must leave of that edge.
constexpr double kLeastEdge = 0.4;
/// What a move must leave of the sum of the distances' squares, at most.
constexpr double kGain = 0.97;
/// How low cells may become at first, scaled Jacobian: what can be had at that price is not bought dearer.
constexpr std::array<double, 2> kFirstFloors = {0.6, 0.4};
/// Ways that are tried in all directions, in lengths of the vertex's shortest boundary edge.
constexpr std::array<double, 3> kSteps = {0.25, 0.12, 0.06};
/// What they must leave of the sum of high powers, at most.
constexpr double kSteepGain = 0.9;
/// Places on a quad along each of its parameters where it is measured then.
constexpr std::array<double, 3> kLattice = {1.0 / 6, 0.5, 5.0 / 6};
constexpr int kLatticePlaces = static_cast<int>(kLattice.size() * kLattice.size());

class CreaseFollower {
  public:
    CreaseFollower(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                   const FollowOptions& options, Context& context)
        : mesh_(mesh), topology_(topology), model_(model), options_(options), context_(context),
          limit_(options.distance_rel * model.diagonal()), edge_limit_(options.edge_rel * model.diagonal()),
          floor_(options.min_sj), quads_(mesh, topology, model),
          creases_(find_patch_creases(model, kLeastTurn_deg * std::numbers::pi / 180, 0)) {
        collect_surface();
    }

    Result<FollowReport> run() {
        FollowReport report;
        measure();
        summarise(report.far_before, report.largest_before_rel);
        Status done = Done{};
        for (double floor : kFirstFloors)
            if (done && floor > options_.min_sj) done = follow(floor, report.moved);
        if (done) done = follow(options_.min_sj, report.moved);
        if (done && options_.search_rel > 0) done = search_farthest(report.moved);
        if (!done) return done.error();
        summarise(report.far_after, report.largest_after_rel); // place() has kept the distances
        return report;
    }

  private:
    Status follow(double floor, std::size_t& moved) {
        floor_ = floor;
        std::fill(is_done_.begin(), is_done_.end(), 0);
        return sweep(options_.rounds, moved, [&](Index v) { return improve(v); });
    }

    Status search_farthest(std::size_t& moved) {
        limit_ = edge_limit_ = options_.search_rel * model_.diagonal();
        std::fill(is_done_.begin(), is_done_.end(), 0);
        tries_left_ =
            static_cast<std::size_t>(options_.search_share * static_cast<double>(mesh_.cell_count()));
        const Status done = sweep(options_.search_rounds, moved, [&](Index v) { return search(v); });
        limit_ = options_.distance_rel * model_.diagonal();
        return done;
    }

    /// Rounds over the vertices of far quads and edges round which something has changed.
    template <class Move>
    Status sweep(int rounds, std::size_t& moved, const Move& move) {
        for (int round = 0; round < rounds; ++round) {
            const std::size_t before = moved;
            std::vector<Index> due = vertices_near_far_quads();
            std::erase_if(due, [&](Index v) { return is_done_[v] != 0; });
            for (Index v : due) is_done_[v] = 1;
            for (Index v : due) {
                if (context_.is_cancelled())
                    return make_error(ErrorCode::cancelled, "settle", "", "cancelled");
                moved += move(v);
            }
            if (moved == before) break;
        }
        return Done{};
    }

    void collect_surface() {
        const std::size_t count = mesh_.vertex_count();
        is_done_.assign(count, 0);
        is_in_vain_.assign(count, 0);
        far_.assign(count, 0);
        hanging_row_.assign(count, kNoIndex);
        for (Index row = 0; row < mesh_.hanging.count(); ++row) hanging_row_[mesh_.hanging.vertex[row]] = row;
        collect_followers(quads_.at_vertices());
        distance_.assign(quads_.size(), 0);
    }

    /// What moves along with vertices that others hang on, and whose quads and cells then count too.
    void collect_followers(const Csr<Index>& quads) {
        const Hanging& hanging = mesh_.hanging;
        for (std::size_t row = 0; row < hanging.count(); ++row)
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                followers_[hanging.master[k]].rows.push_back(row);
        const auto unite = [](std::vector<Index>& list) {
            std::sort(list.begin(), list.end());
            list.erase(std::unique(list.begin(), list.end()), list.end());
        };
        const auto add = [&](Follower& all, Index v) {
            all.quads.insert(all.quads.end(), quads[v].begin(), quads[v].end());
            for (const CellCorner& corner : topology_.vertex_cell[v]) all.cells.push_back(corner.cell);
        };
        for (auto& [master, all] : followers_) {
            add(all, master);
            for (std::size_t row : all.rows) add(all, hanging.vertex[row]);
            unite(all.quads);
            unite(all.cells);
        }
    }

    /// Sets a vertex and those that hang on it.
    void set_position(Index v, const Point& p) {
        mesh_.positions[v] = p;
        const auto found = followers_.find(v);
        if (found == followers_.end()) return;
        const Hanging& hanging = mesh_.hanging;
        for (std::size_t row : found->second.rows) {
            Point sum(0);
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                sum += hanging.weight[k] * mesh_.positions[hanging.master[k]];
            mesh_.positions[hanging.vertex[row]] = sum;
        }
    }

    std::span<const Index> quads_round(Index v) const {
        const auto found = followers_.find(v);
        return found == followers_.end() ? quads_.at(v) : std::span<const Index>(found->second.quads);
    }

    std::vector<Index> cells_round(Index v) const {
        const auto found = followers_.find(v);
        if (found != followers_.end()) return found->second.cells;
        std::vector<Index> cells;
        for (const CellCorner& corner : topology_.vertex_cell[v]) cells.push_back(corner.cell);
        return cells;
    }

    /// Of all quads; each corner is measured once.
    void measure() {
        const Parallel& parallel = context_.parallel();
        parallel.for_each(quads_.size(), 64, [&](std::size_t q) {
            for (int place = 0; place < kPlaces; ++place)
                distance_[q] = std::max(distance_[q], distance_at(static_cast<Index>(q), place));
        });
        std::vector<double> of_vertex(mesh_.vertex_count());
        parallel.for_each(of_vertex.size(), 64, [&](std::size_t v) {
            if (const auto vertex = static_cast<Index>(v); !quads_.at(vertex).empty())
                of_vertex[v] = quads_.vertex_distance(vertex);
        });
        for (std::size_t q = 0; q < quads_.size(); ++q)
            for (Index v : quads_[q]) distance_[q] = std::max(distance_[q], of_vertex[v]);
    }

    void summarise(std::size_t& far, double& largest_rel) const {
        far = static_cast<std::size_t>(
            std::count_if(distance_.begin(), distance_.end(), [&](double d) { return d > limit_; }));
        const auto largest = std::max_element(distance_.begin(), distance_.end());
        largest_rel = largest == distance_.end() ? 0 : *largest / model_.diagonal();
    }

    /// Each once, those of the farthest first.
    std::vector<Index> vertices_near_far_quads() {
        std::vector<Index> vertices;
        const auto add = [&](Index v, double distance, double limit) {
            if (!(distance > limit)) return;
            if (far_[v] == 0) vertices.push_back(v);
            far_[v] = std::max(far_[v], distance);
        };
        for (std::size_t q = 0; q < quads_.size(); ++q)
            for (Index v : quads_[q]) add(v, distance_[q], limit_);
        for (const auto& [a, b] : model_.feature_edges()) {
            const double distance = quads_.edge_distance(a, b);
            add(a, distance, edge_limit_);
            add(b, distance, edge_limit_);
        }
        std::sort(vertices.begin(), vertices.end(),
                  [&](Index a, Index b) { return far_[a] != far_[b] ? far_[a] > far_[b] : a < b; });
        for (Index v : vertices) far_[v] = 0;
        return vertices;
    }

    struct CellsRound {
        std::vector<Index> cell;
        std::vector<CellValidity> before;
    };

    CellsRound look_round(Index v) const {
        CellsRound round{cells_round(v), {}};
        for (Index cell : round.cell) round.before.push_back(compute_cell_validity(cell_points(mesh_, cell)));
        return round;
    }

    /// Moves a vertex; what its quads' vertices do is open again.
    void place(Index v, const Point& p) {
        set_position(v, p);
        for (Index q : quads_round(v)) {
            distance_[q] = quads_.distance(q);
            for (Index u : quads_[q]) open(u);
        }
    }

    /// Lets a vertex be tried again; what is round those that it hangs on has changed, too.
    void open(Index v) {
        is_done_[v] = is_in_vain_[v] = 0;
        const Hanging& hanging = mesh_.hanging;
        const Index row = hanging_row_[v];
        if (row == kNoIndex) return;
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            is_in_vain_[hanging.master[k]] = 0;
    }

    /// Moves a vertex step by step in whatever direction brings what is round it nearer; whether it did.
    bool search(Index v) {
        if (tries_left_ == 0) return false;
        const auto at = quads_.find_place(v);
        if (!at) return false;
        --tries_left_;
        const Association on = model_.associations()[v];
        const Point start = mesh_.positions[v];
        const double shortest = shortest_edge(v);
        const LocalFrame frame = model_.local_frame(on, *at);
        const CellsRound cells = look_round(v);
        const double before = steep_badness(v, std::numeric_limits<double>::infinity());
        const int directions = frame.freedom == 1 ? 2 : 8;
        double least = before;
        Point best = start;
        for (double step : kSteps) {
            const Point from = best;
            for (int k = 0; k < directions; ++k) {
                const double angle = 2 * std::numbers::pi * k / directions;
                Point way = std::cos(angle) * frame.axis[0];
                if (frame.freedom == 2) way += std::sin(angle) * frame.axis[1];
                const Point p = model_.project(on, from + step * shortest * way, at->element).point;
                set_position(v, p);
                if (shortest_edge(v) < kLeastEdge * shortest) continue;
                const double now = steep_badness(v, least);
                if (now < least && keeps_cells(cells)) least = now, best = p;
            }
        }
        set_position(v, start);
        if (!(least < kSteepGain * before)) return false;
        place(v, best);
        return true;
    }

    /// Sum of high powers of the distances round a vertex: what the largest of them is, but smooth. Not
    /// beyond `enough`.
    double steep_badness(Index v, double enough) {
        const auto part = [&](double distance) {
            const double share = distance / limit_, square = share * share;
            return square * square * square * square;
        };
        const std::span<const Index> quads = quads_round(v);
        if (std::find(quads.begin(), quads.end(), steep_refusal_.quad) != quads.end())
            if (const double one = part(lattice_distance(steep_refusal_.quad, steep_refusal_.place));
                one >= enough)
                return one;
        double sum = 0;
        for (Index u : quads_.ridge(v)) sum += part(quads_.edge_distance(v, u));
        for (Index q : quads)
            for (int place = 0; place < kLatticePlaces; ++place) {
                if (sum >= enough) return sum;
                sum += part(lattice_distance(q, place));
                if (sum >= enough) steep_refusal_ = {q, place};
            }
        return sum;
    }

    double lattice_distance(Index q, int place) {
        const std::array<Point, 4> x = quads_.corners(q);
        const double s = kLattice[static_cast<std::size_t>(place) / kLattice.size()],
                     t = kLattice[static_cast<std::size_t>(place) % kLattice.size()];
        const Point p = (1 - t) * ((1 - s) * x[0] + s * x[1]) + t * ((1 - s) * x[3] + s * x[2]);
        return quads_.distance(q, p);
    }

    /// Moves a vertex to the best of the places near it; whether it did.
    bool improve(Index v) {
        if (is_in_vain_[v]) return false;
        is_in_vain_[v] = 1; // unless cells are in the way or it moves
        const auto found = quads_.find_place(v);
        if (!found) return false;
        const Projection& at = *found;
        const Association on = model_.associations()[v];
        const Point start = mesh_.positions[v];
        std::vector<Point> places = on.kind == EntityKind::patch ? crease_places(at) : bends(at);
        for (std::size_t k = 0, whole = places.size(); k < whole; ++k)
            places.push_back(model_.project(on, 0.5 * (start + places[k]), at.element).point);
        const double shortest = shortest_edge(v), reach = kReach * shortest;
        std::erase_if(places, [&](const Point& p) {
            const double way = glm::distance(p, start);
            return way > reach || way < 1e-9 * model_.diagonal();
        });
        if (places.empty()) return false;
        Badness least = badness(v, Badness::unlimited());
        std::optional<CellsRound> cells;
        Point best = start;
        auto tried = places.begin(); // since `least` changed: edges share their ends
        for (auto place = places.begin(); place != places.end(); ++place) {
            const Point& p = *place;
            if (std::find(tried, place, p) != place) continue;
            set_position(v, p);
            const Badness now = badness(v, least);
            if (!now.is_better(least) || shortest_edge(v) < kLeastEdge * shortest) continue;
            if (!cells) {
                set_position(v, start);
                cells = look_round(v);
                set_position(v, p);
            }
            if (keeps_cells(*cells))
                least = now, best = p, tried = place;
            else
                is_in_vain_[v] = 0;
        }
        set_position(v, start);
        if (best == start) return false;
        place(v, best);
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
        for (Index q : quads_.at(v))
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
        /// What is not better does not become it by more places.
        bool is_better(const Badness& than) const {
            return sum < kGain * than.sum && largest <= 1.05 * than.largest;
        }
        static Badness unlimited() {
            constexpr double infinity = std::numeric_limits<double>::infinity();
            return {infinity, infinity};
        }
    };

    /// Not beyond where it is no better than `than`; first where the last one ended.
    Badness badness(Index v, const Badness& than) {
        const std::span<const Index> quads = quads_round(v);
        if (std::find(quads.begin(), quads.end(), refusal_.quad) != quads.end()) {
            Badness one;
            one.add(distance_at(refusal_.quad, refusal_.place));
            if (!one.is_better(than)) return one;
        }
        Badness all;
        for (Index q : quads)
            for (int place = 0; place < kPlaces; ++place) {
                all.add(distance_at(q, place));
                if (all.is_better(than)) continue;
                refusal_ = {q, place};
                return all;
            }
        for (Index u : quads_.ridge(v)) all.add(quads_.edge_distance(v, u));
        return all;
    }

    /// A quad's centre and the middles of its edges.
    static constexpr int kPlaces = 5;

    double distance_at(Index q, int place) {
        const std::array<Point, 4> x = quads_.corners(q);
        const Point p = place == 0 ? quad_centre(x) : 0.5 * (x[place - 1] + x[place % 4]);
        return quads_.distance(q, p);
    }

    bool keeps_cells(const CellsRound& round) const {
        for (std::size_t k = 0; k < round.cell.size(); ++k) {
            const CellValidity now = compute_cell_validity(cell_points(mesh_, round.cell[k]));
            if (!now.is_usable() || now.scaled_jacobian < std::min(round.before[k].scaled_jacobian, floor_))
                return false;
        }
        return true;
    }

    struct Follower {
        std::vector<std::size_t> rows; ///< of Hanging
        std::vector<Index> quads, cells;
    };

    HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel& model_;
    const FollowOptions& options_;
    Context& context_;
    double limit_, edge_limit_; ///< of quads and of edges on curves, model units
    double floor_;              ///< scaled Jacobian that cells may become as bad as
    SurfaceQuads quads_;
    PatchCreases creases_;
    std::vector<double> distance_;         ///< per quad, model units
    std::vector<double> far_;              ///< per vertex, 0 between uses
    std::size_t tries_left_ = 0;           ///< of search()
    std::vector<Index> hanging_row_;       ///< per vertex: of Hanging, kNoIndex: it does not hang
    std::map<Index, Follower> followers_;  ///< of vertices that others hang on
    std::vector<std::uint8_t> is_done_;    ///< per vertex: tried since its quads changed
    std::vector<std::uint8_t> is_in_vain_; ///< and no place was better, whatever the cells
    /// Where a vertex's new place was last found to be no better: that is asked first.
    struct Refusal {
        Index quad = kNoIndex;
        int place = 0;
    };
    Refusal refusal_, steep_refusal_; ///< of badness() and steep_badness()
};

} // namespace

Result<FollowReport> follow_creases(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                    const FollowOptions& options, Context& context) {
    return CreaseFollower(mesh, topology, model, options, context).run();
}

} // namespace hexopt
