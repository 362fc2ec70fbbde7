#include "stages/trim/surface_check.hpp"

#include "domain/boundary_polygons.hpp"

#include <algorithm>
#include <array>

namespace hexopt::trimming {

namespace {

struct Use {
    Index low, high, polygon;
    bool forward;
    auto operator<=>(const Use&) const = default;
};

struct Fan {
    Index vertex, polygon, next; ///< polygon and the one across the edge that leaves the vertex
    auto operator<=>(const Fan&) const = default;
};

std::vector<Use> collect_uses(const Csr<Index>& loops) {
    std::vector<Use> uses;
    uses.reserve(loops.item.size());
    for (Index p = 0; p < loops.rows(); ++p) {
        const auto loop = loops[p];
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Index a = loop[i], b = loop[(i + 1) % loop.size()];
            uses.push_back({std::min(a, b), std::max(a, b), p, a < b});
        }
    }
    std::sort(uses.begin(), uses.end());
    return uses;
}

/// Turning round a vertex from any polygon must pass them all.
bool is_one_fan(std::span<const Fan> at) {
    Index polygon = at[0].polygon;
    for (std::size_t steps = 1; steps <= at.size(); ++steps) {
        const auto found =
            std::find_if(at.begin(), at.end(), [&](const Fan& f) { return f.polygon == polygon; });
        if (found == at.end()) return false;
        polygon = found->next;
        if (polygon == at[0].polygon) return steps == at.size();
    }
    return false;
}

} // namespace

SurfaceFaults check_surface(const HexMesh& mesh, const Topology& topology) {
    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    const std::vector<Use> uses = collect_uses(polygons.vertex);
    SurfaceFaults faults;
    std::vector<Fan> fans;
    for (std::size_t i = 0; i < uses.size();) {
        std::size_t end = i + 1;
        while (end < uses.size() && uses[end].low == uses[i].low && uses[end].high == uses[i].high) ++end;
        if (end - i == 1) {
            ++faults.open_edges;
        } else if (end - i > 2 || uses[i].forward == uses[i + 1].forward) {
            ++faults.nonmanifold_edges;
        } else {
            const bool first = uses[i].forward; // leaves `low`
            const Use& from_low = first ? uses[i] : uses[i + 1];
            const Use& from_high = first ? uses[i + 1] : uses[i];
            fans.push_back({uses[i].low, from_low.polygon, from_high.polygon});
            fans.push_back({uses[i].high, from_high.polygon, from_low.polygon});
        }
        i = end;
    }
    if (faults.open_edges + faults.nonmanifold_edges > 0) return faults;
    std::sort(fans.begin(), fans.end());
    for (std::size_t i = 0; i < fans.size();) {
        std::size_t end = i + 1;
        while (end < fans.size() && fans[end].vertex == fans[i].vertex) ++end;
        if (!is_one_fan(std::span(fans).subspan(i, end - i))) ++faults.nonmanifold_vertices;
        i = end;
    }
    return faults;
}

} // namespace hexopt::trimming
