#include "stages/buffer/insert_sheet.hpp"

namespace hexopt {

namespace {

constexpr double kCopyShift = 0.4; ///< of the way to the cells' centres

/// For so many more, and some to spare: there may be many sheets. Arrays of the whole mesh that grow by
/// themselves come to be twice as large as they need be.
template <class T>
void make_room(std::vector<T>& array, std::size_t more) {
    const std::size_t needed = array.size() + more;
    if (needed > array.capacity()) array.reserve(needed + needed / 16);
}

/// Edges between flagged vertices that cells have, to see which splits remain.
class EdgeSet {
  public:
    EdgeSet(const SheetMesh& mesh, std::span<const Index> cells, const std::vector<std::uint8_t>& flagged) {
        for (Index c : cells)
            for (const auto& edge : hex::kEdgeVertex) {
                const Index a = mesh.cells[c][edge[0]], b = mesh.cells[c][edge[1]];
                if (flagged[a] && flagged[b]) edges_.push_back(edge_key(a, b));
            }
        std::sort(edges_.begin(), edges_.end());
        edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    }

    bool has(Index a, Index b) const {
        return std::binary_search(edges_.begin(), edges_.end(), edge_key(a, b));
    }

  private:
    std::vector<EdgeKey> edges_;
};

/// Passes midpoints and centres on to the copies: an entry holds wherever the new mesh has the whole edge or
/// face and the parts that there were before.
class SplitUpdate {
  public:
    SplitUpdate(SheetMesh& mesh, const std::vector<Index>& copy_of) : mesh_(mesh), copy_of_(copy_of) {
        if (mesh.splits.empty()) return;
        flagged_.assign(mesh.positions.size(), 0);
        part_tables();
        if (middles_.empty() && centres_.empty()) return;
        for (Index c = 0; c < mesh.cells.size(); ++c) {
            const Cell& cell = mesh.cells[c];
            if (std::count_if(cell.begin(), cell.end(), [&](Index v) { return flagged_[v]; }) > 1)
                near_.push_back(c);
        }
        const EdgeSet before(mesh, near_, flagged_);
        for (Middle& m : middles_)
            m.halves = {before.has(low_of(m.entry.edge), m.entry.vertex),
                        before.has(m.entry.vertex, high_of(m.entry.edge))};
        for (Index c : near_)
            for (std::uint32_t f = 0; f < 6; ++f) find_centre_face({c, f});
    }

    /// After cells have got their new vertices and those from `first_new` on have been added.
    void finish(std::size_t first_new) {
        if (middles_.empty() && centres_.empty()) return;
        flagged_.resize(mesh_.positions.size(), 0);
        for (Index v = 0; v < copy_of_.size(); ++v)
            if (copy_of_[v] != kNoIndex) flagged_[copy_of_[v]] = flagged_[v];
        for (std::size_t c = first_new; c < mesh_.cells.size(); ++c) near_.push_back(static_cast<Index>(c));
        const EdgeSet after(mesh_, near_, flagged_);
        for (const Middle& m : middles_) pass_on(m, after);
        std::sort(mesh_.splits.middles.begin(), mesh_.splits.middles.end());
        for (const CentreFace& face : faces_) pass_on(face, after);
        auto& centres = mesh_.splits.centres;
        std::sort(centres.begin(), centres.end());
        centres.erase(std::unique(centres.begin(), centres.end()), centres.end());
    }

  private:
    struct Middle {
        SplitTables::Middle entry;
        std::array<bool, 2> halves = {false, false}; ///< that cells have, low end first
    };
    struct CentreFace {
        CellFace face;
        Index centre;
    };

    bool is_doubled(Index v) const { return copy_of_[v] != kNoIndex; }

    /// Takes the entries that touch the sheet out of the tables.
    void part_tables() {
        SplitTables rest;
        for (const SplitTables::Middle& entry : mesh_.splits.middles) {
            const std::array vertices = {low_of(entry.edge), high_of(entry.edge), entry.vertex};
            if (std::none_of(vertices.begin(), vertices.end(), [&](Index v) { return is_doubled(v); })) {
                rest.middles.push_back(entry);
                continue;
            }
            middles_.push_back({entry});
            for (Index v : vertices) flagged_[v] = 1;
        }
        for (const SplitTables::Centre& entry : mesh_.splits.centres) {
            const Quad& q = entry.corners;
            if (!is_doubled(entry.vertex) &&
                std::none_of(q.begin(), q.end(), [&](Index v) { return is_doubled(v); })) {
                rest.centres.push_back(entry);
                continue;
            }
            centres_.push_back(entry);
            flagged_[entry.vertex] = 1;
            for (Index v : q) flagged_[v] = 1;
        }
        // The middles of such a face's edges are needed to see whether its centre is used.
        for (const SplitTables::Middle& entry : mesh_.splits.middles)
            if (flagged_[low_of(entry.edge)] && flagged_[high_of(entry.edge)]) flagged_[entry.vertex] = 1;
        mesh_.splits = std::move(rest);
    }

    void find_centre_face(CellFace face) {
        const Quad quad = sorted_quad(mesh_.vertices_of(face));
        const auto at = std::lower_bound(centres_.begin(), centres_.end(), SplitTables::Centre{quad, 0});
        if (at != centres_.end() && at->corners == quad) faces_.push_back({face, at->vertex});
    }

    /// A vertex and its copy, if it has one.
    std::array<Index, 2> both(Index v) const { return {v, v < copy_of_.size() ? copy_of_[v] : kNoIndex}; }

    void pass_on(const Middle& m, const EdgeSet& after) {
        for (Index a : both(low_of(m.entry.edge)))
            for (Index b : both(high_of(m.entry.edge))) {
                if (a == kNoIndex || b == kNoIndex || !after.has(a, b)) continue;
                for (Index v : both(m.entry.vertex))
                    if (v != kNoIndex && (m.halves[0] || m.halves[1]) && (!m.halves[0] || after.has(a, v)) &&
                        (!m.halves[1] || after.has(v, b)))
                        mesh_.splits.middles.push_back({edge_key(a, b), v});
            }
    }

    void pass_on(const CentreFace& face, const EdgeSet& after) {
        const Quad quad = mesh_.vertices_of(face.face);
        for (Index centre : both(face.centre)) {
            if (centre == kNoIndex) continue;
            bool used = true;
            for (int s = 0; s < 4; ++s) {
                const Index m = mesh_.splits.middle(quad[s], quad[(s + 1) % 4]);
                used = used && m != kNoIndex && after.has(m, centre);
            }
            if (used) mesh_.splits.centres.push_back({sorted_quad(quad), centre});
        }
    }

    SheetMesh& mesh_;
    const std::vector<Index>& copy_of_; ///< per old vertex
    std::vector<std::uint8_t> flagged_;
    std::vector<Middle> middles_;
    std::vector<SplitTables::Centre> centres_;
    std::vector<CentreFace> faces_;
    std::vector<Index> near_; ///< cells with an edge between flagged vertices
};

class SheetInsertion {
  public:
    SheetInsertion(SheetMesh& mesh, const SheetPlan& plan, const BoundaryModel& model,
                   const Parallel& parallel)
        : mesh_(mesh), plan_(plan), model_(model), parallel_(parallel),
          copy_of_(mesh.positions.size(), kNoIndex) {
        auto next = static_cast<Index>(mesh.positions.size());
        for (const SheetVertex& v : plan.vertices) copy_of_[v.vertex] = next++;
    }

    void run() {
        const std::size_t old_cells = mesh_.cells.size();
        make_room(mesh_.cells, plan_.quads.size());
        make_room(mesh_.level, plan_.quads.size());
        make_room(mesh_.positions, plan_.vertices.size());
        make_room(mesh_.association, plan_.vertices.size());
        if (!mesh_.unfitted.empty()) make_room(mesh_.unfitted, plan_.vertices.size());
        SplitUpdate splits(mesh_, copy_of_);
        const std::vector<Point> targets = find_targets(mesh_.positions);
        const std::vector<Point> unfitted_targets =
            mesh_.unfitted.empty() ? std::vector<Point>{} : find_targets(mesh_.unfitted);
        renumber_cells();
        add_cells();
        add_surface();
        add_ridges();
        add_vertices(targets);
        if (!mesh_.unfitted.empty()) add_unfitted(unfitted_targets);
        splits.finish(old_cells);
    }

  private:
    Index inner(Index v) const { return copy_of_[v]; }

    /// Per sheet vertex, where what moves off goes: along the edges of its curve, into the quads of its patch
    /// or, in the interior, into the cells that go with it.
    std::vector<Point> find_targets(const std::vector<Point>& positions) const {
        std::vector<Point> target = find_cell_targets(positions);
        std::vector<Point> sum(target.size(), Point(0));
        std::vector<double> count(target.size(), 0);
        const auto add = [&](Index v, bool goes_with_a, Association along, const Point& at) {
            if (v >= copy_of_.size() || inner(v) == kNoIndex) return;
            const std::size_t i = inner(v) - copy_of_.size();
            const SheetVertex& vertex = plan_.vertices[i];
            if (vertex.inner_stays == goes_with_a) return;
            if ((vertex.inner_stays ? vertex.outer : vertex.inner) == along) sum[i] += at, count[i] += 1;
        };
        for (Index q = 0; q < plan_.in_b.size(); ++q) {
            const SurfaceQuad& quad = mesh_.surface[q];
            const Quad vertices = mesh_.vertices_of(quad.face);
            Point centre(0);
            for (Index v : vertices) centre += 0.25 * positions[v];
            for (Index v : vertices)
                add(v, plan_.in_a[quad.face.cell] && !plan_.in_b[q], {EntityKind::patch, quad.patch}, centre);
        }
        std::vector<std::uint8_t> is_inner(mesh_.ridges.size(), 0);
        for (Index r : plan_.inner_ridges) is_inner[r] = 1;
        for (Index r = 0; r < mesh_.ridges.size(); ++r) {
            const FittedMesh::RidgeEdge& ridge = mesh_.ridges[r];
            const Point middle = 0.5 * (positions[ridge.a] + positions[ridge.b]);
            for (Index v : {ridge.a, ridge.b}) add(v, is_inner[r], {EntityKind::curve, ridge.curve}, middle);
        }
        for (std::size_t i = 0; i < target.size(); ++i)
            if (count[i] > 0) target[i] = sum[i] / count[i];
        return target;
    }

    /// Per sheet vertex: mean centre of the cells that what moves off goes with.
    std::vector<Point> find_cell_targets(const std::vector<Point>& positions) const {
        const std::size_t first = positions.size();
        std::vector<Point> sum(plan_.vertices.size(), Point(0));
        std::vector<double> count(plan_.vertices.size(), 0);
        for (Index c = 0; c < plan_.in_a.size(); ++c) {
            const Cell& cell = mesh_.cells[c];
            if (std::none_of(cell.begin(), cell.end(), [&](Index v) { return inner(v) != kNoIndex; }))
                continue;
            Point centre(0);
            for (Index v : cell) centre += 0.125 * positions[v];
            for (Index v : cell) {
                if (inner(v) == kNoIndex) continue;
                const std::size_t i = inner(v) - first;
                if (plan_.vertices[i].inner_stays == (plan_.in_a[c] != 0)) continue;
                sum[i] += centre, count[i] += 1;
            }
        }
        for (std::size_t i = 0; i < sum.size(); ++i)
            sum[i] = count[i] > 0 ? sum[i] / count[i] : positions[plan_.vertices[i].vertex];
        return sum;
    }

    void renumber_cells() {
        parallel_.for_each(plan_.in_a.size(), 8192, [&](std::size_t c) {
            if (!plan_.in_a[c]) return;
            for (Index& v : mesh_.cells[c])
                if (inner(v) != kNoIndex) v = inner(v);
        });
    }

    void add_cells() {
        for (const SheetQuad& quad : plan_.quads) {
            const Quad& q = quad.vertices;
            mesh_.cells.push_back(
                {inner(q[0]), inner(q[1]), inner(q[2]), inner(q[3]), q[0], q[1], q[2], q[3]});
            mesh_.level.push_back(mesh_.level[quad.inside]);
        }
    }

    void add_surface() {
        constexpr std::array<std::uint32_t, 4> kSideFace = {2, 1, 3, 0};
        constexpr std::uint32_t kOuterFace = 5;
        const auto first = static_cast<Index>(plan_.in_a.size());
        for (Index q = 0; q < plan_.quads.size(); ++q)
            if (plan_.quads[q].surface != kNoIndex)
                mesh_.surface[plan_.quads[q].surface].face = {first + q, kOuterFace};
        for (const StripQuad& strip : plan_.strips)
            mesh_.surface.push_back({{first + strip.quad, kSideFace[strip.side]}, strip.patch, strip.region});
    }

    void add_ridges() {
        for (Index r : plan_.inner_ridges) {
            FittedMesh::RidgeEdge& ridge = mesh_.ridges[r];
            if (inner(ridge.a) != kNoIndex) ridge.a = inner(ridge.a);
            if (inner(ridge.b) != kNoIndex) ridge.b = inner(ridge.b);
            if (ridge.a > ridge.b) std::swap(ridge.a, ridge.b);
        }
        for (const SheetVertex& v : plan_.vertices)
            if (v.strip_curve != kNoIndex) mesh_.ridges.push_back({v.vertex, inner(v.vertex), v.strip_curve});
        std::sort(mesh_.ridges.begin(), mesh_.ridges.end());
    }

    void add_vertices(const std::vector<Point>& targets) {
        const std::size_t first = mesh_.positions.size();
        mesh_.positions.resize(first + plan_.vertices.size());
        mesh_.association.resize(first + plan_.vertices.size());
        parallel_.for_each(plan_.vertices.size(), 256, [&](std::size_t i) {
            const SheetVertex& v = plan_.vertices[i];
            const Point old = mesh_.positions[v.vertex];
            const Association bound = v.inner_stays ? v.outer : v.inner;
            const Point moved = model_.project(bound, old + kCopyShift * (targets[i] - old)).point;
            mesh_.positions[v.vertex] = v.inner_stays ? moved : old;
            mesh_.positions[first + i] = v.inner_stays ? old : moved;
            mesh_.association[v.vertex] = v.outer;
            mesh_.association[first + i] = v.inner;
        });
    }

    void add_unfitted(const std::vector<Point>& targets) {
        const std::size_t first = mesh_.unfitted.size();
        mesh_.unfitted.resize(first + targets.size());
        for (std::size_t i = 0; i < targets.size(); ++i) {
            const SheetVertex& v = plan_.vertices[i];
            const Point old = mesh_.unfitted[v.vertex], moved = old + kCopyShift * (targets[i] - old);
            mesh_.unfitted[v.vertex] = v.inner_stays ? moved : old;
            mesh_.unfitted[first + i] = v.inner_stays ? old : moved;
        }
    }

    SheetMesh& mesh_;
    const SheetPlan& plan_;
    const BoundaryModel& model_;
    const Parallel& parallel_;
    std::vector<Index> copy_of_; ///< per old vertex: the copy, kNoIndex: none
};

} // namespace

std::vector<SheetProblem> insert_sheet(SheetMesh& mesh, const SheetChoice& choice, const BoundaryModel& model,
                                       const Parallel& parallel) {
    SheetPlan plan = plan_sheet(mesh, choice);
    if (plan.problems.empty()) SheetInsertion(mesh, plan, model, parallel).run();
    return std::move(plan.problems);
}

} // namespace hexopt
