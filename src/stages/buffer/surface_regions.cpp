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

std::vector<Index> RegionGroups::numbers() const {
    std::vector<Index> number(parent_.size());
    Index next = 0;
    for (Index r = 0; r < parent_.size(); ++r) {
        const Index root = find(r);
        number[r] = root == r ? next++ : number[root];
    }
    return number;
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
