#include "stages/buffer/insert_sheet.hpp"

#include <numeric>
#include <optional>

namespace hexopt {

const char* name_of(SheetFault fault) {
    switch (fault) {
    case SheetFault::open_face:
        return "open_face";
    case SheetFault::crossed:
        return "crossed";
    case SheetFault::pinched:
        return "pinched";
    case SheetFault::half_strip:
        return "half_strip";
    case SheetFault::open_sheet:
        return "open_sheet";
    case SheetFault::crowded:
        return "crowded";
    }
    return "";
}

namespace {

/// Quads between the cells of A and the others, on the fine side where levels meet.
class Interface {
  public:
    Interface(const SheetMesh& mesh, SheetPlan& plan) : mesh_(mesh), plan_(plan) {}

    void find(std::span<const Index> cells) {
        gather(cells);
        std::vector<Index> single;
        for (std::size_t i = 0; i < faces_.size();) {
            std::size_t end = i + 1;
            while (end < faces_.size() && faces_[end].key == faces_[i].key) ++end;
            if (end == i + 2) add_between(faces_[i].face, faces_[i + 1].face, faces_[i].face);
            if (end == i + 1 && !on_surface(faces_[i].face)) single.push_back(static_cast<Index>(i));
            i = end;
        }
        match_levels(single);
    }

  private:
    struct Face {
        Quad key;
        CellFace face;
        auto operator<=>(const Face&) const = default;
    };

    /// Faces of A and of the cells round it that have a vertex of A.
    void gather(std::span<const Index> cells) {
        std::vector<std::uint8_t> near(mesh_.positions.size(), 0);
        for (Index c : cells)
            for (Index v : mesh_.cells[c]) near[v] = 1;
        surface_.assign(mesh_.cells.size(), 0);
        for (const SurfaceQuad& quad : mesh_.surface)
            surface_[quad.face.cell] |= static_cast<std::uint8_t>(1 << quad.face.face);
        for (Index c = 0; c < mesh_.cells.size(); ++c) {
            const Cell& cell = mesh_.cells[c];
            if (std::none_of(cell.begin(), cell.end(), [&](Index v) { return near[v]; })) continue;
            for (std::uint32_t f = 0; f < 6; ++f) {
                const Quad quad = mesh_.vertices_of({c, f});
                if (near[quad[0]] || near[quad[1]] || near[quad[2]] || near[quad[3]])
                    faces_.push_back({sorted_quad(quad), {c, f}});
            }
        }
        std::sort(faces_.begin(), faces_.end());
    }

    bool on_surface(CellFace face) const { return surface_[face.cell] >> face.face & 1; }

    /// `fine`: whichever of the two gives the sheet's quad.
    void add_between(CellFace one, CellFace other, CellFace fine) {
        if (plan_.in_a[one.cell] == plan_.in_a[other.cell]) return;
        const CellFace inside = plan_.in_a[one.cell] ? one : other;
        Quad quad = mesh_.vertices_of(fine);
        if (fine != inside) std::reverse(quad.begin(), quad.end());
        plan_.quads.push_back({quad, inside.cell, kNoIndex});
    }

    void match_levels(std::span<const Index> single) {
        std::vector<std::uint8_t> matched(faces_.size(), 0);
        for (Index i : single) {
            std::vector<Index> parts;
            if (!cover(mesh_.vertices_of(faces_[i].face), 0, parts)) continue;
            matched[i] = 1;
            for (Index part : parts) {
                matched[part] = 1;
                add_between(faces_[i].face, faces_[part].face, faces_[part].face);
            }
        }
        for (Index i : single)
            if (!matched[i] && plan_.in_a[faces_[i].face.cell])
                plan_.problems.push_back({faces_[i].key[0], SheetFault::open_face});
    }

    Index find_face(const Quad& quad) const {
        const Quad key = sorted_quad(quad);
        const auto at = std::lower_bound(faces_.begin(), faces_.end(), Face{key, {0, 0}});
        return at != faces_.end() && at->key == key ? static_cast<Index>(at - faces_.begin()) : kNoIndex;
    }

    /// Finds the faces that cover a quad cut at its middles and centre, over at most three levels.
    bool cover(const Quad& q, int depth, std::vector<Index>& parts) const {
        if (depth > 0)
            if (const Index face = find_face(q); face != kNoIndex) {
                parts.push_back(face);
                return true;
            }
        if (depth == 3) return false;
        const SplitTables& splits = mesh_.splits;
        const std::array<Index, 4> m = {splits.middle(q[0], q[1]), splits.middle(q[1], q[2]),
                                        splits.middle(q[2], q[3]), splits.middle(q[3], q[0])};
        const auto all = [&](std::initializer_list<Quad> quads) {
            const std::size_t before = parts.size();
            for (const Quad& quad : quads)
                if (!cover(quad, depth + 1, parts)) return parts.resize(before), false;
            return true;
        };
        const bool along = m[0] != kNoIndex && m[2] != kNoIndex;
        const bool across = m[1] != kNoIndex && m[3] != kNoIndex;
        if (const Index o = splits.centre(q); o != kNoIndex && along && across)
            if (all({{q[0], m[0], o, m[3]},
                     {m[0], q[1], m[1], o},
                     {o, m[1], q[2], m[2]},
                     {m[3], o, m[2], q[3]}}))
                return true;
        if (along && all({{q[0], m[0], m[2], q[3]}, {m[0], q[1], q[2], m[2]}})) return true;
        return across && all({{q[0], q[1], m[1], m[3]}, {m[3], m[1], q[2], q[3]}});
    }

    const SheetMesh& mesh_;
    SheetPlan& plan_;
    std::vector<std::uint8_t> surface_; ///< per cell: bit f: face f is on the boundary
    std::vector<Face> faces_;           ///< sorted
};

/// Sheet quads at one vertex, joined over the sheet's edges there.
class FanCheck {
  public:
    explicit FanCheck(SheetPlan& plan) : plan_(plan) {}

    void add(std::span<const EdgeUse> uses) {
        for (Index v : {low_of(uses[0].edge), high_of(uses[0].edge)})
            links_.push_back({v, uses.front().quad, uses.back().quad});
    }

    void check() {
        std::sort(links_.begin(), links_.end());
        for (std::size_t i = 0; i < links_.size();) {
            std::size_t end = i;
            while (end < links_.size() && links_[end].vertex == links_[i].vertex) ++end;
            if (!is_connected({links_.data() + i, end - i}))
                plan_.problems.push_back({links_[i].vertex, SheetFault::pinched});
            i = end;
        }
    }

  private:
    struct Link {
        Index vertex, quad, other;
        auto operator<=>(const Link&) const = default;
    };

    static bool is_connected(std::span<const Link> links) {
        std::vector<Index> reached = {links[0].quad};
        std::vector<std::uint8_t> used(links.size(), 0);
        const auto has = [&](Index q) {
            return std::find(reached.begin(), reached.end(), q) != reached.end();
        };
        for (bool grows = true; grows;) {
            grows = false;
            for (std::size_t i = 0; i < links.size(); ++i) {
                if (used[i] || !(has(links[i].quad) || has(links[i].other))) continue;
                used[i] = 1, grows = true;
                if (!has(links[i].quad)) reached.push_back(links[i].quad);
                if (!has(links[i].other)) reached.push_back(links[i].other);
            }
        }
        return std::all_of(used.begin(), used.end(), [](std::uint8_t u) { return u != 0; });
    }

    SheetPlan& plan_;
    std::vector<Link> links_;
};

/// Where the sheet meets the surface: strips, and what its vertices and their copies are bound to.
class SurfaceCut {
  public:
    SurfaceCut(const SheetMesh& mesh, SheetPlan& plan)
        : mesh_(mesh), plan_(plan), place_(mesh.positions.size(), kNoIndex),
          parents_(mesh.splits.middles_by_vertex()) {
        for (const SheetQuad& quad : plan.quads)
            for (Index v : quad.vertices) place_[v] = 0;
        for (Index v = 0; v < place_.size(); ++v)
            if (place_[v] == 0) {
                place_[v] = static_cast<Index>(plan.vertices.size());
                plan.vertices.push_back({v, {}, {}});
            }
        gather_surface();
    }

    void find(const EdgeUses& sheet_edges) {
        std::vector<Ends> ends(plan_.vertices.size());
        for_each_edge(sheet_edges, [&](std::span<const EdgeUse> uses) {
            if (uses.size() == 1) add_strip(uses[0], ends);
        });
        std::vector<Ridges> ridges(plan_.vertices.size());
        count_ridges(ridges);
        std::vector<std::uint8_t> kinds(plan_.vertices.size(), 0);
        for (Index q : local_)
            for (Index v : mesh_.vertices_of(mesh_.surface[q].face))
                if (place_[v] != kNoIndex) kinds[place_[v]] |= goes_with_a(q) ? 2 : 1;
        for (Index i = 0; i < plan_.vertices.size(); ++i) bind(i, ends[i], ridges[i], kinds[i]);
    }

  private:
    struct Ends {
        int count = 0;
        std::array<Index, 2> patch = {kNoIndex, kNoIndex};
    };
    struct Ridges {
        int inner = 0, outer = 0;
        Index curve = kNoIndex; ///< of an inner one
    };

    bool goes_with_a(Index quad) const {
        return plan_.in_a[mesh_.surface[quad].face.cell] && !plan_.in_b[quad];
    }

    void gather_surface() {
        std::vector<Quad> quads;
        for (Index q = 0; q < mesh_.surface.size(); ++q) {
            const Quad quad = mesh_.vertices_of(mesh_.surface[q].face);
            if (std::none_of(quad.begin(), quad.end(), [&](Index v) { return is_near(v); }) &&
                !passes_sheet(quad))
                continue;
            local_.push_back(q);
            quads.push_back(quad);
        }
        SplitTables none;
        edges_ = find_edge_uses(quads, none);
    }

    bool is_near(Index v) const { return place_[v] != kNoIndex; }

    bool passes_sheet(const Quad& quad) const {
        if (mesh_.splits.middles.empty()) return false;
        for (int s = 0; s < 4; ++s)
            if (const Index m = mesh_.splits.middle(quad[s], quad[(s + 1) % 4]); m != kNoIndex && is_near(m))
                return true;
        return false;
    }

    /// Surface quads along an edge of the sheet: with the same edge, its halves, or one that it is half of.
    std::vector<Index> quads_along(EdgeKey edge) const {
        std::vector<Index> quads;
        const auto append = [&](EdgeKey key) {
            for (const EdgeUse& use : edges_.of(key)) quads.push_back(local_[use.quad]);
        };
        const Index a = low_of(edge), b = high_of(edge);
        append(edge);
        if (const Index m = mesh_.splits.middle(a, b); m != kNoIndex)
            append(edge_key(a, m)), append(edge_key(m, b));
        for (auto [end, other] : {std::array{a, b}, std::array{b, a}})
            if (const EdgeKey whole = edge_split_at(end);
                whole && (low_of(whole) == other || high_of(whole) == other))
                append(whole);
        return quads;
    }

    EdgeKey edge_split_at(Index vertex) const {
        const auto at = std::lower_bound(parents_.begin(), parents_.end(), vertex,
                                         [](const SplitTables::Middle& m, Index v) { return m.vertex < v; });
        return at != parents_.end() && at->vertex == vertex ? at->edge : 0;
    }

    void add_strip(const EdgeUse& use, std::vector<Ends>& ends) {
        Index beside = kNoIndex;
        for (Index q : quads_along(use.edge))
            if (goes_with_a(q)) beside = std::min(beside, q);
        if (beside == kNoIndex) {
            plan_.problems.push_back({low_of(use.edge), SheetFault::open_sheet});
            return;
        }
        const SurfaceQuad& quad = mesh_.surface[beside];
        plan_.strips.push_back({use.quad, use.side, quad.patch, quad.region});
        for (Index v : {low_of(use.edge), high_of(use.edge)}) {
            Ends& at = ends[place_[v]];
            if (at.count < 2) at.patch[at.count] = quad.patch;
            ++at.count;
        }
    }

    /// A ridge goes with A if all the surface beside it does.
    void count_ridges(std::vector<Ridges>& ridges) {
        for (Index r = 0; r < mesh_.ridges.size(); ++r) {
            const FittedMesh::RidgeEdge& ridge = mesh_.ridges[r];
            if (!is_near(ridge.a) && !is_near(ridge.b)) continue;
            const std::vector<Index> beside = quads_along(edge_key(ridge.a, ridge.b));
            const bool inner = !beside.empty() && std::all_of(beside.begin(), beside.end(),
                                                              [&](Index q) { return goes_with_a(q); });
            if (inner) plan_.inner_ridges.push_back(r);
            for (Index v : {ridge.a, ridge.b}) {
                if (!is_near(v)) continue;
                Ridges& at = ridges[place_[v]];
                ++(inner ? at.inner : at.outer);
                if (inner) at.curve = ridge.curve;
            }
        }
    }

    void bind(Index i, const Ends& ends, const Ridges& ridges, std::uint8_t kinds) {
        SheetVertex& vertex = plan_.vertices[i];
        const Association old = mesh_.association[vertex.vertex];
        vertex.outer = old;
        if (kinds == 0) return;
        if (ends.count == 0) {
            if (kinds == 3) plan_.problems.push_back({vertex.vertex, SheetFault::pinched});
            if (kinds == 2) swap_places(vertex, {});
            return;
        }
        const auto [first, second] = ends.patch;
        const Index patch = old.kind == EntityKind::patch && old.entity == second ? second : first;
        const Association on_patch =
            patch == kNoIndex ? Association{} : Association{EntityKind::patch, patch};
        if (ridges.inner == 0) {
            vertex.inner = on_patch;
        } else if (ridges.inner == 1) {
            vertex.inner = {EntityKind::curve, ridges.curve};
            vertex.strip_curve = ridges.curve;
        } else if (first == second && ridges.outer == 0) {
            swap_places(vertex, on_patch);
        } else {
            plan_.problems.push_back({vertex.vertex, SheetFault::crowded});
        }
    }

    /// The copy is what the vertex was.
    void swap_places(SheetVertex& vertex, Association outer) {
        vertex.inner = vertex.outer;
        vertex.outer = outer;
        vertex.inner_stays = true;
    }

    const SheetMesh& mesh_;
    SheetPlan& plan_;
    std::vector<Index> place_; ///< per vertex: in plan.vertices
    std::vector<SplitTables::Middle> parents_;
    std::vector<Index> local_; ///< surface quads that touch the sheet
    EdgeUses edges_;           ///< of these
};

void choose(const SheetMesh& mesh, const SheetChoice& choice, SheetPlan& plan) {
    plan.in_a.assign(mesh.cells.size(), choice.all_cells ? 1 : 0);
    for (Index c : choice.cells) plan.in_a[c] = 1;
    plan.in_b.assign(mesh.surface.size(), 0);
    for (Index q : choice.quads) plan.in_b[q] = 1;
    for (Index q : choice.quads) {
        const CellFace face = mesh.surface[q].face;
        plan.quads.push_back({mesh.vertices_of(face), face.cell, q});
    }
    if (!choice.all_cells) Interface(mesh, plan).find(choice.cells);
}

} // namespace

SheetPlan plan_sheet(const SheetMesh& mesh, const SheetChoice& choice) {
    SheetPlan plan;
    choose(mesh, choice, plan);
    std::vector<Quad> quads;
    quads.reserve(plan.quads.size());
    for (const SheetQuad& quad : plan.quads) quads.push_back(quad.vertices);
    const EdgeUses edges = find_edge_uses(quads, mesh.splits);
    for (EdgeKey edge : edges.half_used) plan.problems.push_back({low_of(edge), SheetFault::half_strip});
    FanCheck fans(plan);
    for_each_edge(edges, [&](std::span<const EdgeUse> uses) {
        if (uses.size() > 2) plan.problems.push_back({low_of(uses[0].edge), SheetFault::crossed});
        fans.add(uses);
    });
    fans.check();
    SurfaceCut(mesh, plan).find(edges);
    std::sort(plan.problems.begin(), plan.problems.end());
    plan.problems.erase(std::unique(plan.problems.begin(), plan.problems.end()), plan.problems.end());
    return plan;
}

} // namespace hexopt
