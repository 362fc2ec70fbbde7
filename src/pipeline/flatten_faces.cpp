#include "pipeline/flatten_faces.hpp"

#include "mesh/hanging.hpp"
#include "pipeline/surface_quads.hpp"
#include "pipeline/undo_contacts.hpp"
#include "quality/cell_quality.hpp"
#include "quality/face_tets.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <optional>

namespace hexopt {

namespace {

/// Margin (FaceTets) up to which a face counts as warped, as for OpenFOAM; up to which it is mended all the
/// same; and above which one is.
constexpr double kFlat = 1e-9, kSound = 2e-4, kMended = 1e-3;
/// Shares of a face's warp that are taken away.
constexpr std::array<double, 5> kShares = {0.5, 0.25, 0.75, 1, 1.25};
constexpr int kRounds = 4;  ///< over the faces that are left
constexpr int kPasses = 20; ///< over the vertices round a face, with steps of one length
/// Steps looked for once moves that mend nothing are taken back, and again once vertices slide: so many, and
/// so many for each cell of the mesh. Where dozens of low cells surround warped faces most are in vain.
constexpr double kTries = 20e3, kTriesPerCell = 0.1;
/// By how much of itself a step must raise what it is to raise.
constexpr double kLeastRise = 1e-3;
/// Cells worse than a limit by up to this are raised where they are in the way.
constexpr double kEnough = 0.1;
/// Steps that single vertices take, in lengths of the shortest edge of their cells.
constexpr std::array<double, 4> kSteps = {0.2, 0.1, 0.05, 0.02};

template <class T>
void unite(std::vector<T>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
}

class FaceFlattener {
  public:
    FaceFlattener(HexMesh& mesh, const Topology& topology, const PolyhedralFaces& faces,
                  const FlattenOptions& options)
        : mesh_(mesh), topology_(topology), options_(options), tets_(faces, mesh.cell_count()),
          min_sj_(options.min_sj) {}

    Result<FlattenReport> run(Context& context) {
        FlattenReport report;
        warped_ = tets_.find_warped(mesh_.positions, kSound, context.parallel());
        report.warped_before = static_cast<std::size_t>(
            std::count_if(warped_.begin(), warped_.end(), [&](std::size_t face) { return is_warped(face); }));
        if (!warped_.empty()) collect_followers();
        Status done = mend_all(context);
        if (done) drop_sound();
        if (done && !warped_.empty()) {
            min_sj_ = std::min(min_sj_, options_.last_min_sj);
            keeps_parts_ = false; // worse cells for nothing
            renew_tries();
            done = mend_all(context);
        }
        if (done) drop_sound();
        if (done && !warped_.empty() && options_.model) done = slide(context);
        if (!done) return done.error();
        report.warped_after = warped_.size();
        report.moved = moved_;
        report.slid = slid_;
        if (!warped_.empty()) report.first_left = middle(warped_.front());
        return report;
    }

  private:
    /// Where vertices are to go, one of the mesh's each.
    struct Move {
        std::vector<Index> vertices;
        std::vector<Point> to;
    };

    /// What a move may change, and how it was.
    struct Surroundings {
        std::vector<Index> cells;
        std::vector<CellValidity> validity;
        std::vector<std::size_t> faces;
        std::vector<double> margin;
        std::vector<Index> quads; ///< of the boundary, while vertices may slide
        std::vector<double> quad_distance;
        std::vector<std::array<Index, 2>> edges; ///< on curves
        std::vector<double> edge_distance;
    };

    bool is_inside(Index v) const {
        return !topology_.on_boundary[v] &&
               (topology_.hanging_row.empty() || topology_.hanging_row[v] == kNoIndex);
    }

    bool can_move(Index v) const { return is_inside(v) || (surface_ && surface_->find_place(v)); }

    /// Mends what is left by letting vertices of the boundary slide, too; not where it then touches itself.
    Status slide(Context& context) {
        const std::vector<Point> start = mesh_.positions;
        const std::vector<std::size_t> left = warped_;
        const std::size_t moved = moved_;
        surface_.emplace(mesh_, topology_, *options_.model);
        renew_tries();
        Status done = mend_all(context);
        surface_.reset();
        if (!done) mesh_.positions = start; // which touches nothing
        if (!done || moved_ == moved) return done;
        undo_contacts(mesh_, topology_, start, min_sj_, context.parallel());
        warped_ = tets_.find_warped(mesh_.positions, kFlat, context.parallel());
        if (warped_.size() >= left.size()) {
            mesh_.positions = start;
            warped_ = left;
            moved_ = moved;
            return Done{};
        }
        for (Index v = 0; v < mesh_.vertex_count(); ++v)
            slid_ += topology_.on_boundary[v] && mesh_.positions[v] != start[v];
        return Done{};
    }

    void renew_tries() {
        tries_left_ =
            static_cast<std::size_t>(kTries + kTriesPerCell * static_cast<double>(mesh_.cell_count()));
    }

    void collect_followers() {
        const Hanging& hanging = mesh_.hanging;
        for (Index row = 0; row < hanging.count(); ++row)
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                followers_[hanging.master[k]].push_back(row);
    }

    Status mend_all(Context& context) {
        for (int round = 0; round < kRounds && !warped_.empty(); ++round) {
            const std::size_t before = moved_;
            for (const std::size_t face : warped_) {
                if (context.is_cancelled())
                    return make_error(ErrorCode::cancelled, "flatten", "", "cancelled");
                if (is_unsound(face)) mend(face);
            }
            std::erase_if(warped_, [&](std::size_t face) { return !is_unsound(face); });
            if (moved_ == before) break;
        }
        return Done{};
    }

    bool is_warped(std::size_t face) const { return !(tets_.margin(face, mesh_.positions) > kFlat); }
    bool is_unsound(std::size_t face) const { return !(tets_.margin(face, mesh_.positions) > kSound); }

    /// Leaves those that are warped.
    void drop_sound() {
        std::erase_if(warped_, [&](std::size_t face) { return !is_warped(face); });
    }

    void mend(std::size_t face) {
        if (flatten(face)) return;
        std::vector<Index> vertices;
        const auto add = [&](Index cell) {
            for (Index v : mesh_.cells[cell])
                if (can_move(v)) vertices.push_back(v);
        };
        add(tets_.owner(face));
        if (tets_.is_internal(face)) add(tets_.neighbour(face));
        unite(vertices);
        const std::vector<Index> wide = movable_round(vertices);
        std::vector<Point> start;
        for (Index v : wide) start.push_back(mesh_.positions[v]);
        const std::size_t moved = moved_;
        climb(face, vertices);
        if (keeps_parts_ || !is_unsound(face)) return;
        for (std::size_t k = 0; k < start.size(); ++k) set(wide[k], start[k]);
        moved_ = moved;
    }

    /// Vertices that may move of all cells that moving those would change; with those, rising.
    std::vector<Index> movable_round(std::span<const Index> vertices) {
        std::vector<Index> wide;
        for (Index cell : look_round(vertices).cells)
            for (Index v : mesh_.cells[cell])
                if (can_move(v)) wide.push_back(v);
        unite(wide);
        return wide;
    }

    /// Moves vertices step by step while that raises the face's margin and it is not mended; at last also
    /// such that cells that are in the way get better.
    void climb(std::size_t face, std::span<const Index> vertices) {
        for (double step : kSteps)
            for (int pass = 0; pass < kPasses; ++pass) {
                bool rose = false;
                for (Index v : vertices) {
                    rose = raise_margin(face, v, step) || rose;
                    if (tets_.margin(face, mesh_.positions) > kMended) return;
                }
                if (!rose && (keeps_parts_ || !give_way(face, vertices, step))) break;
            }
    }

    /// Raises the worst cells round the vertices by moving theirs; whether any rose.
    bool give_way(std::size_t face, std::span<const Index> vertices, double step) {
        bool rose = false;
        for (Index cell : look_round(vertices).cells) {
            if (scaled_jacobian(cell) >= min_sj_ + kEnough) continue;
            for (Index v : mesh_.cells[cell])
                if (can_move(v)) rose = raise_cell(cell, face, v, step) || rose;
        }
        return rose;
    }

    double scaled_jacobian(Index cell) const {
        return compute_cell_validity(cell_points(mesh_, cell)).scaled_jacobian;
    }

    /// Moves the corners of a quad towards their common plane; those that may not move leave it to the
    /// others.
    bool flatten(std::size_t face) {
        const std::span<const Index> corners = tets_.corners(face);
        if (corners.size() != 4) return false;
        std::array<Point, 4> x;
        for (int k = 0; k < 4; ++k) x[k] = mesh_.positions[corners[k]];
        const Point normal = glm::cross(x[2] - x[0], x[3] - x[1]);
        const double size2 = glm::dot(normal, normal);
        if (!(size2 > 0)) return false;
        const Point warp = glm::dot(x[0] + x[2] - x[1] - x[3], normal) / size2 * normal;
        Move move;
        std::vector<double> side;
        for (int k = 0; k < 4; ++k)
            if (is_inside(corners[k])) {
                move.vertices.push_back(corners[k]);
                side.push_back(k % 2 == 0 ? -1 : 1);
            }
        if (move.vertices.empty()) return false;
        const Surroundings round = look_round(move.vertices);
        for (double share : kShares) {
            move.to.clear();
            for (std::size_t k = 0; k < side.size(); ++k)
                move.to.push_back(mesh_.positions[move.vertices[k]] +
                                  side[k] * share / static_cast<double>(side.size()) * warp);
            if (make(move, face, round)) return true;
        }
        return false;
    }

    bool raise_margin(std::size_t face, Index v, double step) {
        return nudge(v, step, [&] { return tets_.margin(face, mesh_.positions); });
    }

    /// Not where it lowers the face's margin.
    bool raise_cell(Index cell, std::size_t face, Index v, double step) {
        const double margin = tets_.margin(face, mesh_.positions);
        return nudge(v, step, [&] {
            return tets_.margin(face, mesh_.positions) < margin ? -1 : scaled_jacobian(cell);
        });
    }

    /// Moves a vertex by a step in the direction that raises a value most, within what it is bound to;
    /// whether there is one.
    template <class Value>
    bool nudge(Index v, double step, const Value& value) {
        if (!keeps_parts_ && tries_left_ == 0) return false;
        if (!keeps_parts_) --tries_left_;
        const Surroundings round = look_round(std::span(&v, 1));
        const double length = step * shortest_edge(round.cells);
        const Point from = mesh_.positions[v];
        const double start = value();
        double best = start + kLeastRise * std::abs(start);
        Point to = from;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    if (x == 0 && y == 0 && z == 0) continue;
                    const Point way(x, y, z);
                    const Point p = bring_home(v, from + length / glm::length(way) * way);
                    set(v, p);
                    const double now = value();
                    if (now > best && is_harmless(round)) best = now, to = p;
                }
        set(v, to);
        moved_ += to != from;
        return to != from;
    }

    /// The closest place that a vertex may have.
    Point bring_home(Index v, const Point& p) const {
        return is_inside(v) ? p : options_.model->project(options_.model->associations()[v], p).point;
    }

    double shortest_edge(std::span<const Index> cells) const {
        double shortest = std::numeric_limits<double>::infinity();
        for (Index cell : cells)
            for (double length : edge_lengths(cell_points(mesh_, cell)))
                shortest = std::min(shortest, length);
        return shortest;
    }

    void look_at_surface(Index v, Surroundings& round) {
        if (!surface_) return;
        for (Index q : surface_->at(v)) {
            round.quads.push_back(q);
            round.quad_distance.push_back(surface_->distance(q));
        }
        for (Index u : surface_->ridge(v)) {
            round.edges.push_back({v, u});
            round.edge_distance.push_back(surface_->edge_distance(v, u));
        }
    }

    Surroundings look_round(std::span<const Index> vertices) {
        Surroundings round;
        const auto add = [&](Index v) {
            for (const CellCorner& corner : topology_.vertex_cell[v]) round.cells.push_back(corner.cell);
        };
        for (Index v : vertices) {
            add(v);
            look_at_surface(v, round);
            if (const auto found = followers_.find(v); found != followers_.end())
                for (Index row : found->second) {
                    add(mesh_.hanging.vertex[row]);
                    look_at_surface(mesh_.hanging.vertex[row], round);
                }
        }
        unite(round.cells);
        for (Index cell : round.cells) {
            round.validity.push_back(compute_cell_validity(cell_points(mesh_, cell)));
            for (std::size_t face : tets_.faces_of(cell)) round.faces.push_back(face >> 1);
        }
        unite(round.faces);
        for (std::size_t face : round.faces) round.margin.push_back(tets_.margin(face, mesh_.positions));
        return round;
    }

    /// Makes a move if it mends the face and harms nothing; else all stays.
    bool make(const Move& move, std::size_t face, const Surroundings& round) {
        std::vector<Point> from;
        for (Index v : move.vertices) from.push_back(mesh_.positions[v]);
        for (std::size_t k = 0; k < from.size(); ++k) set(move.vertices[k], move.to[k]);
        if (tets_.margin(face, mesh_.positions) > kMended && is_harmless(round)) {
            moved_ += from.size();
            return true;
        }
        for (std::size_t k = 0; k < from.size(); ++k) set(move.vertices[k], from[k]);
        return false;
    }

    bool is_harmless(const Surroundings& round) {
        for (std::size_t k = 0; k < round.cells.size(); ++k) {
            const CellValidity now = compute_cell_validity(cell_points(mesh_, round.cells[k]));
            if (is_worse(now, round.validity[k]) && !(now.is_usable() && now.scaled_jacobian >= min_sj_))
                return false;
        }
        for (std::size_t k = 0; k < round.faces.size(); ++k) {
            const double before = round.margin[k], least = before > kSound  ? kSound
                                                           : before > kFlat ? kFlat
                                                                            : before - kSound;
            if (tets_.margin(round.faces[k], mesh_.positions) <= least) return false;
        }
        return keeps_to_surface(round);
    }

    bool keeps_to_surface(const Surroundings& round) {
        if (!surface_) return true;
        const double slack = options_.slack_rel * options_.model->diagonal();
        for (std::size_t k = 0; k < round.quads.size(); ++k)
            if (surface_->distance(round.quads[k]) > std::max(round.quad_distance[k], slack)) return false;
        for (std::size_t k = 0; k < round.edges.size(); ++k)
            if (surface_->edge_distance(round.edges[k][0], round.edges[k][1]) >
                std::max(round.edge_distance[k], slack))
                return false;
        return true;
    }

    /// Sets a vertex and those that hang on it.
    void set(Index v, const Point& p) {
        mesh_.positions[v] = p;
        if (const auto found = followers_.find(v); found != followers_.end())
            for (Index row : found->second)
                mesh_.positions[mesh_.hanging.vertex[row]] =
                    hanging_position(mesh_.hanging, mesh_.positions, row);
    }

    Point middle(std::size_t face) const {
        Point sum(0);
        for (Index v : tets_.corners(face)) sum += mesh_.positions[v];
        return sum / static_cast<double>(tets_.corners(face).size());
    }

    HexMesh& mesh_;
    const Topology& topology_;
    const FlattenOptions& options_;
    FaceTets tets_;
    double min_sj_;
    std::optional<SurfaceQuads> surface_; ///< while vertices of the boundary may slide
    bool keeps_parts_ = true;             ///< moves that did not mend their face may help the next round
    std::vector<std::size_t> warped_;     ///< left; what mends one warps no other
    std::map<Index, std::vector<Index>> followers_; ///< rows of Hanging of what hangs on a vertex
    std::size_t tries_left_ = 0;                    ///< of nudge(), once parts are not kept
    std::size_t moved_ = 0, slid_ = 0;
};

} // namespace

std::string describe_warped(const FlattenReport& report) {
    const Point& p = report.first_left;
    return fmt::format(
        "{} faces are so warped that no way of cutting them suits the cells on both sides "
        "(lowQualityTetFaces of OpenFOAM's checkMesh), the first near ({:.6g}, {:.6g}, {:.6g}).",
        report.warped_after, p.x, p.y, p.z);
}

Result<FlattenReport> flatten_faces(HexMesh& mesh, const Topology& topology, const FlattenOptions& options,
                                    Context& context) {
    const auto faces = compute_polyhedral_faces(mesh, topology, context.parallel());
    if (!faces) return faces.error();
    return FaceFlattener(mesh, topology, *faces, options).run(context);
}

} // namespace hexopt
