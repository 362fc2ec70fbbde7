#include "stages/buffer/surface_regions.hpp"

#include "stages/buffer/edge_uses.hpp"

#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kMostRidges = 3; ///< at a vertex, for a split

std::vector<Quad> surface_vertices(const SheetMesh& mesh) {
    std::vector<Quad> quads;
    quads.reserve(mesh.surface.size());
    for (const SurfaceQuad& quad : mesh.surface) quads.push_back(mesh.vertices_of(quad.face));
    return quads;
}

/// Curve along an edge or along the edge that it is half of.
class RidgeFinder {
  public:
    explicit RidgeFinder(const SheetMesh& mesh) : mesh_(mesh), parents_(mesh.splits.middles_by_vertex()) {}

    Index curve_of(EdgeKey edge) const {
        const Index a = low_of(edge), b = high_of(edge);
        if (const Index curve = mesh_.curve_of(a, b); curve != kNoIndex) return curve;
        for (auto [middle, end] : {std::array{a, b}, std::array{b, a}}) {
            const auto at =
                std::lower_bound(parents_.begin(), parents_.end(), middle,
                                 [](const SplitTables::Middle& m, Index v) { return m.vertex < v; });
            if (at == parents_.end() || at->vertex != middle) continue;
            const Index low = low_of(at->edge), high = high_of(at->edge);
            if (low == end || high == end) return mesh_.curve_of(low, high);
        }
        return kNoIndex;
    }

  private:
    const SheetMesh& mesh_;
    std::vector<SplitTables::Middle> parents_;
};

struct RegionAt {
    Index vertex, region;
    auto operator<=>(const RegionAt&) const = default;
};

/// Regions at every vertex that is on more than one, sorted.
std::vector<RegionAt> regions_at_vertices(const SheetMesh& mesh) {
    std::vector<RegionAt> list;
    list.reserve(4 * mesh.surface.size());
    for (const SurfaceQuad& quad : mesh.surface)
        for (Index v : mesh.vertices_of(quad.face)) list.push_back({v, quad.region});
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    return list;
}

/// Joins what meets at vertices where a group has more than one fan of quads: there are more borders between
/// groups than groups. True if anything was joined.
bool join_pinched(const std::vector<RegionAt>& at, const std::vector<EdgeUse>& borders,
                  const std::vector<Index>& region, std::size_t vertex_count, RegionGroups& groups) {
    std::vector<std::uint8_t> border_count(vertex_count, 0);
    for (std::size_t i = 0; i + 1 < borders.size(); i += 2) {
        if (groups.find(region[borders[i].quad]) == groups.find(region[borders[i + 1].quad])) continue;
        for (Index v : {low_of(borders[i].edge), high_of(borders[i].edge)})
            if (border_count[v] < 255) ++border_count[v];
    }
    bool joined = false;
    for (std::size_t i = 0; i < at.size();) {
        std::size_t end = i;
        std::vector<Index> present;
        for (; end < at.size() && at[end].vertex == at[i].vertex; ++end)
            present.push_back(groups.find(at[end].region));
        std::sort(present.begin(), present.end());
        present.erase(std::unique(present.begin(), present.end()), present.end());
        if (present.size() > 1 && border_count[at[i].vertex] != present.size())
            for (Index group : present) joined |= groups.join(present[0], group);
        i = end;
    }
    return joined;
}

} // namespace

SurfaceRegions find_regions(SheetMesh& mesh) {
    const EdgeUses edges = find_edge_uses(surface_vertices(mesh), mesh.splits);
    const RidgeFinder ridges(mesh);
    RegionGroups parts(static_cast<Index>(mesh.surface.size()));
    std::vector<SurfaceRegions::Border> borders;
    for_each_edge(edges, [&](std::span<const EdgeUse> uses) {
        if (uses.size() != 2) return;
        const Index curve = ridges.curve_of(uses[0].edge);
        if (curve == kNoIndex)
            parts.join(uses[0].quad, uses[1].quad);
        else
            borders.push_back({uses[0].quad, uses[1].quad, curve});
    });
    const std::vector<Index> number = parts.numbers();
    SurfaceRegions regions;
    for (Index q = 0; q < mesh.surface.size(); ++q) {
        mesh.surface[q].region = number[q];
        regions.count = std::max(regions.count, number[q] + 1);
    }
    for (const SurfaceRegions::Border& border : borders) {
        const auto [a, b] = std::minmax(number[border.a], number[border.b]);
        regions.borders.push_back({a, b, border.curve});
    }
    std::sort(regions.borders.begin(), regions.borders.end());
    regions.borders.erase(std::unique(regions.borders.begin(), regions.borders.end()), regions.borders.end());
    return regions;
}

std::vector<SurfaceRegions::Border> find_borders(const SheetMesh& mesh) {
    const RidgeFinder ridges(mesh);
    std::vector<SurfaceRegions::Border> borders;
    for_each_edge(find_edge_uses(surface_vertices(mesh), mesh.splits), [&](std::span<const EdgeUse> uses) {
        if (uses.size() != 2) return;
        const Index curve = ridges.curve_of(uses[0].edge);
        if (curve == kNoIndex) return;
        const auto [a, b] = std::minmax(mesh.surface[uses[0].quad].region, mesh.surface[uses[1].quad].region);
        borders.push_back({a, b, curve});
    });
    std::sort(borders.begin(), borders.end());
    borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
    return borders;
}

namespace {

/// Bands of quads on either side of loose ridges.
class LooseRidges {
  public:
    explicit LooseRidges(const SheetMesh& mesh)
        : mesh_(mesh), band_(static_cast<Index>(mesh.surface.size())), ridge_ends_(mesh.positions.size(), 0),
          in_band_(mesh.surface.size(), 0) {
        const RidgeFinder ridges(mesh);
        const auto sort_in = [&](std::span<const EdgeUse> uses) {
            if (uses.size() != 2) return;
            const Side side{uses[0].edge, uses[0].quad, uses[1].quad, ridges.curve_of(uses[0].edge)};
            if (side.curve == kNoIndex) return inner_.push_back(side);
            if (mesh.surface[side.a].region == mesh.surface[side.b].region) loose_.push_back(side);
            for (Index v : ends_of(side))
                if (ridge_ends_[v] < 2) ++ridge_ends_[v];
        };
        for_each_edge(find_edge_uses(surface_vertices(mesh), mesh.splits), sort_in);
    }

    bool empty() const { return loose_.empty(); }

    /// Quads beside the ridges, joined round the ridges' inner vertices: of all ridges together, then, where
    /// that joins both sides of one, curve by curve. Then `rings` - 1 rings more.
    void find(int rings) {
        mark(loose_);
        std::vector<Side> joined = drop_joined_sides(loose_);
        std::stable_sort(joined.begin(), joined.end(),
                         [](const Side& x, const Side& y) { return x.curve < y.curve; });
        for (std::size_t i = 0; i < joined.size();) {
            std::size_t end = i;
            while (end < joined.size() && joined[end].curve == joined[i].curve) ++end;
            const std::vector<Side> curve(joined.begin() + static_cast<std::ptrdiff_t>(i),
                                          joined.begin() + static_cast<std::ptrdiff_t>(end));
            mark(curve);
            drop_joined_sides(curve);
            i = end;
        }
        for (int ring = 1; ring < rings; ++ring) widen();
    }

    /// Per quad: its band, numbered from 0; kNoIndex outside.
    std::vector<Index> numbers(Index& count) const {
        std::vector<Index> number(mesh_.surface.size(), kNoIndex), of_root(mesh_.surface.size(), kNoIndex);
        count = 0;
        for (Index q = 0; q < number.size(); ++q) {
            if (!in_band_[q]) continue;
            Index& n = of_root[band_.find(q)];
            if (n == kNoIndex) n = count++;
            number[q] = n;
        }
        return number;
    }

  private:
    struct Side {
        EdgeKey edge;
        Index a, b; ///< the quads beside it
        Index curve;
    };

    static std::array<Index, 2> ends_of(const Side& side) { return {low_of(side.edge), high_of(side.edge)}; }

    /// Takes quads at these ridges' inner vertices that are in no band yet.
    void mark(const std::vector<Side>& ridges) {
        const std::vector<std::uint8_t> before = in_band_;
        std::vector<std::uint8_t> ends(mesh_.positions.size(), 0);
        for (const Side& side : ridges) {
            for (Index quad : {side.a, side.b})
                if (!before[quad]) in_band_[quad] = 1;
            for (Index v : ends_of(side))
                if (ends[v] < 2) ++ends[v];
        }
        const bool all = &ridges == &loose_;
        for (const Side& side : inner_) {
            if (before[side.a] || before[side.b]) continue;
            for (Index v : ends_of(side)) {
                if (ends[v] == 0 || (all ? ridge_ends_[v] : ends[v]) < 2) continue;
                in_band_[side.a] = in_band_[side.b] = 1;
                band_.join(side.a, side.b);
            }
        }
    }

    /// Takes bands that are on both sides of a ridge away again; the ridges beside these.
    std::vector<Side> drop_joined_sides(const std::vector<Side>& ridges) {
        std::vector<std::uint8_t> dropped(mesh_.surface.size(), 0);
        for (const Side& side : ridges)
            if (band_.find(side.a) == band_.find(side.b)) dropped[band_.find(side.a)] = 1;
        std::vector<Side> beside;
        for (const Side& side : ridges)
            if (dropped[band_.find(side.a)] || dropped[band_.find(side.b)]) beside.push_back(side);
        std::vector<Index> freed;
        for (Index q = 0; q < in_band_.size(); ++q)
            if (in_band_[q] && dropped[band_.find(q)]) freed.push_back(q);
        for (Index q : freed) in_band_[q] = 0;
        band_.part(freed);
        return beside;
    }

    void widen() {
        const std::vector<std::uint8_t> before = in_band_;
        for (const Side& side : inner_) {
            if (mesh_.surface[side.a].region != mesh_.surface[side.b].region) continue;
            if (before[side.a] && !in_band_[side.b]) take(side.b, side.a);
            if (before[side.b] && !in_band_[side.a]) take(side.a, side.b);
        }
    }
    void take(Index quad, Index from) {
        in_band_[quad] = 1;
        band_.join(quad, from);
    }

    const SheetMesh& mesh_;
    RegionGroups band_; ///< of quads
    std::vector<Side> inner_, loose_;
    std::vector<std::uint8_t> ridge_ends_; ///< per vertex: ridge edges there, 2: two or more
    std::vector<std::uint8_t> in_band_;    ///< per quad
};

/// Quads round vertices, in order.
class VertexFans {
  public:
    explicit VertexFans(const SheetMesh& mesh)
        : mesh_(mesh), ridges_(mesh), parents_(mesh.splits.middles_by_vertex()) {
        sides_.reserve(4 * mesh.surface.size());
        for (Index i = 0; i < mesh.surface.size(); ++i) {
            const Quad q = mesh.vertices_of(mesh.surface[i].face);
            for (int s = 0; s < 4; ++s)
                sides_.push_back(
                    {q[s], whole_edge(q[s], q[(s + 1) % 4]), whole_edge(q[s], q[(s + 3) % 4]), i});
        }
        std::sort(sides_.begin(), sides_.end());
    }

    /// visit(quads, is_closed) for every run of quads that no ridge and no hanging vertex interrupts.
    template <class Visit>
    void for_each_run(const Visit& visit) const {
        for (std::size_t i = 0; i < sides_.size();) {
            std::size_t end = i;
            while (end < sides_.size() && sides_[end].vertex == sides_[i].vertex) ++end;
            if (has_two_regions(i, end)) follow({sides_.data() + i, end - i}, visit);
            i = end;
        }
    }

  private:
    /// A quad at a vertex: it lies between the edges to `first` and `last`, counter-clockwise.
    struct Side {
        Index vertex, first, last, quad;
        auto operator<=>(const Side&) const = default;
    };

    /// The far end of the coarsest edge that begins at a vertex as the edge to `end` does.
    Index whole_edge(Index vertex, Index end) const {
        for (bool longer = true; longer;) {
            longer = false;
            const auto at =
                std::lower_bound(parents_.begin(), parents_.end(), end,
                                 [](const SplitTables::Middle& m, Index v) { return m.vertex < v; });
            if (at == parents_.end() || at->vertex != end) break;
            if (low_of(at->edge) == vertex)
                end = high_of(at->edge), longer = true;
            else if (high_of(at->edge) == vertex)
                end = low_of(at->edge), longer = true;
        }
        return end;
    }

    bool has_two_regions(std::size_t i, std::size_t end) const {
        return std::any_of(sides_.begin() + static_cast<std::ptrdiff_t>(i),
                           sides_.begin() + static_cast<std::ptrdiff_t>(end), [&](const Side& side) {
                               return mesh_.surface[side.quad].region != mesh_.surface[sides_[i].quad].region;
                           });
    }

    template <class Visit>
    void follow(std::span<const Side> at, const Visit& visit) const {
        std::vector<std::uint8_t> taken(at.size(), 0);
        const auto next_of = [&](std::size_t k) {
            if (ridges_.curve_of(edge_key(at[k].vertex, at[k].last)) != kNoIndex) return at.size();
            std::size_t n = 0;
            while (n < at.size() && at[n].first != at[k].last) ++n;
            return n;
        };
        std::vector<std::uint8_t> is_next(at.size(), 0);
        for (std::size_t k = 0; k < at.size(); ++k)
            if (const std::size_t n = next_of(k); n < at.size()) is_next[n] = 1;
        const auto run_from = [&](std::size_t start) {
            std::vector<Index> run;
            std::size_t k = start;
            for (; k < at.size() && !taken[k]; k = next_of(k)) taken[k] = 1, run.push_back(at[k].quad);
            visit(run, k == start);
        };
        for (std::size_t k = 0; k < at.size(); ++k)
            if (!is_next[k]) run_from(k);
        for (std::size_t k = 0; k < at.size(); ++k)
            if (!taken[k]) run_from(k);
    }

    const SheetMesh& mesh_;
    RidgeFinder ridges_;
    std::vector<SplitTables::Middle> parents_;
    std::vector<Side> sides_; ///< sorted
};

/// Where a region comes more than once in the order of quads round a vertex, the quads there become one
/// region's: sheets cannot leave the surface there otherwise.
void mend_pinched(SheetMesh& mesh) {
    const VertexFans fans(mesh);
    const auto is_pinched = [&](std::span<const Index> run, bool is_closed) {
        std::vector<Index> starts; // the regions of the maximal runs of one region
        for (std::size_t k = 0; k < run.size(); ++k) {
            const Index region = mesh.surface[run[k]].region;
            if (starts.empty() || starts.back() != region) starts.push_back(region);
        }
        if (is_closed && starts.size() > 1 && starts.front() == starts.back()) starts.pop_back();
        std::sort(starts.begin(), starts.end());
        return std::adjacent_find(starts.begin(), starts.end()) != starts.end();
    };
    for (bool again = true; again;) { // ends: regions only fall
        again = false;
        fans.for_each_run([&](std::span<const Index> run, bool is_closed) {
            if (!is_pinched(run, is_closed)) return;
            again = true;
            Index lowest = kNoIndex;
            for (Index q : run) lowest = std::min(lowest, mesh.surface[q].region);
            for (Index q : run) mesh.surface[q].region = lowest;
        });
    }
}

} // namespace

void cut_at_loose_ridges(SheetMesh& mesh, SurfaceRegions& regions, int rings) {
    LooseRidges ridges(mesh);
    if (!ridges.empty()) {
        ridges.find(rings);
        Index bands = 0;
        const std::vector<Index> number = ridges.numbers(bands);
        for (Index q = 0; q < mesh.surface.size(); ++q)
            if (number[q] != kNoIndex) mesh.surface[q].region = regions.count + number[q];
        regions.count += bands;
        mend_pinched(mesh);
    }
    regions.borders = find_borders(mesh);
}

std::vector<Index> find_quads_at_ridges(const SheetMesh& mesh, const Domain& domain, double angle_deg) {
    const RidgeFinder ridges(mesh);
    std::vector<Index> quads;
    for_each_edge(find_edge_uses(surface_vertices(mesh), mesh.splits), [&](std::span<const EdgeUse> uses) {
        const Index curve = ridges.curve_of(uses[0].edge);
        if (curve != kNoIndex && domain.angle[curve].largest >= angle_deg)
            for (const EdgeUse& use : uses) quads.push_back(use.quad);
    });
    return quads;
}

namespace {

/// Flags the quads of the same region that share a vertex with a flagged one.
void grow_in_regions(const SheetMesh& mesh, std::vector<std::uint8_t>& flagged) {
    std::vector<RegionAt> reached;
    for (Index q = 0; q < mesh.surface.size(); ++q)
        if (flagged[q])
            for (Index v : mesh.vertices_of(mesh.surface[q].face))
                reached.push_back({v, mesh.surface[q].region});
    std::sort(reached.begin(), reached.end());
    for (Index q = 0; q < mesh.surface.size(); ++q) {
        if (flagged[q]) continue;
        for (Index v : mesh.vertices_of(mesh.surface[q].face))
            if (std::binary_search(reached.begin(), reached.end(), RegionAt{v, mesh.surface[q].region}))
                flagged[q] = 1;
    }
}

} // namespace

void narrow_regions(SheetMesh& mesh, SurfaceRegions& regions, std::span<const Index> seeds, int rings) {
    std::vector<std::uint8_t> inside(mesh.surface.size(), 0);
    for (Index q : seeds) inside[q] = 1;
    for (int ring = 0; ring < rings; ++ring) grow_in_regions(mesh, inside);
    for (Index q = 0; q < mesh.surface.size(); ++q)
        if (!inside[q]) mesh.surface[q].region += regions.count;
    regions.count *= 2;
    mend_pinched(mesh);
    regions.borders = find_borders(mesh);
}

void widen_regions(SheetMesh& mesh, SurfaceRegions& regions) {
    regions.count /= 2;
    for (SurfaceQuad& quad : mesh.surface) quad.region %= regions.count;
    regions.borders = find_borders(mesh);
}

RegionGroups::RegionGroups(Index region_count) : parent_(region_count) {
    std::iota(parent_.begin(), parent_.end(), Index{0});
}

Index RegionGroups::find(Index region) const {
    while (parent_[region] != region) region = parent_[region] = parent_[parent_[region]];
    return region;
}

bool RegionGroups::join(Index a, Index b) {
    a = find(a), b = find(b);
    if (a == b) return false;
    parent_[std::max(a, b)] = std::min(a, b);
    return true;
}

void RegionGroups::part(std::span<const Index> whole_groups) {
    for (Index region : whole_groups) parent_[region] = region;
}

std::vector<Index> RegionGroups::numbers() const {
    std::vector<Index> number(parent_.size());
    Index next = 0;
    for (Index r = 0; r < parent_.size(); ++r) {
        const Index root = find(r);
        number[r] = root == r ? next++ : number[root];
    }
    return number;
}

void part_pinched(const SheetMesh& mesh, RegionGroups& groups) {
    struct Touch {
        Index vertex, group;
        auto operator<=>(const Touch&) const = default;
    };
    std::vector<Touch> touches; // one for each edge of a group's border at a vertex: two a fan of its quads
    for_each_edge(find_edge_uses(surface_vertices(mesh), mesh.splits), [&](std::span<const EdgeUse> uses) {
        const Index first = groups.find(mesh.surface[uses.front().quad].region);
        const Index last = groups.find(mesh.surface[uses.back().quad].region);
        if (uses.size() > 1 && first == last) return;
        for (Index v : {low_of(uses[0].edge), high_of(uses[0].edge)}) {
            touches.push_back({v, first});
            if (uses.size() > 1) touches.push_back({v, last});
        }
    });
    std::sort(touches.begin(), touches.end());
    std::vector<std::uint8_t> is_pinched(groups.size(), 0);
    for (std::size_t i = 0; i < touches.size();) {
        std::size_t end = i + 1;
        while (end < touches.size() && touches[end] == touches[i]) ++end;
        const std::size_t fans = (end - i) / 2;
        if (fans > 1) is_pinched[touches[i].group] = 1;
        i = end;
    }
    std::vector<Index> parted;
    for (Index region = 0; region < groups.size(); ++region)
        if (is_pinched[groups.find(region)]) parted.push_back(region);
    groups.part(parted);
}

RegionGroups group_for_split(const SheetMesh& mesh, const SurfaceRegions& regions, const Domain& domain,
                             double join_deg) {
    RegionGroups groups(regions.count);
    for (const SurfaceRegions::Border& border : regions.borders)
        if (domain.angle[border.curve].largest >= join_deg) groups.join(border.a, border.b);

    const std::vector<RegionAt> at = regions_at_vertices(mesh);
    std::vector<std::uint8_t> ridge_count(mesh.positions.size(), 0);
    for (const FittedMesh::RidgeEdge& ridge : mesh.ridges)
        for (Index v : {ridge.a, ridge.b})
            if (ridge_count[v] < 255) ++ridge_count[v];
    for (std::size_t i = 1; i < at.size(); ++i)
        if (at[i].vertex == at[i - 1].vertex && ridge_count[at[i].vertex] > kMostRidges)
            groups.join(at[i].region, at[i - 1].region);

    std::vector<Index> region;
    for (const SurfaceQuad& quad : mesh.surface) region.push_back(quad.region);
    std::vector<EdgeUse> borders;
    for_each_edge(find_edge_uses(surface_vertices(mesh), mesh.splits), [&](std::span<const EdgeUse> uses) {
        if (uses.size() == 2 && region[uses[0].quad] != region[uses[1].quad])
            borders.insert(borders.end(), uses.begin(), uses.end());
    });
    while (join_pinched(at, borders, region, mesh.positions.size(), groups)) {
    }
    return groups;
}

} // namespace hexopt
