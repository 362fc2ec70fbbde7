#include "domain/boundary_model_builder.hpp"
#include "domain/domain.hpp"
#include "domain/domain_parts.hpp"
#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <numeric>

namespace hexopt {

namespace {

struct EdgeSide {
    Index patch;
    Index triangle;
};
using EdgeSides = std::map<std::array<Index, 2>, std::vector<EdgeSide>>;

/// Triangles beside the edges of curves.
EdgeSides find_sides(const FeatureGraph& graph, const CleanSurface& surface) {
    EdgeSides sides;
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
            const auto [low, high] = std::minmax(chain[i], chain[i + 1]);
            sides[{low, high}];
        }
    }
    for (Index t = 0; t < surface.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(surface.triangles[t][k], surface.triangles[t][(k + 1) % 3]);
            if (const auto found = sides.find({low, high}); found != sides.end())
                found->second.push_back({graph.face_patch[t], t});
        }
    return sides;
}

/// Interior dihedral angle of two triangles at their common edge, degrees; outward normals n, m.
double interior_angle_deg(const CleanSurface& surface, std::array<Index, 2> edge, Index t, Index s) {
    const auto apex = [&](Index triangle) {
        for (Index v : surface.triangles[triangle])
            if (v != edge[0] && v != edge[1]) return surface.vertices[v];
        return surface.vertices[edge[0]];
    };
    const Point n = surface.polygons.normal[t], m = surface.polygons.normal[s];
    const double turn = std::acos(std::clamp(glm::dot(n, m), -1.0, 1.0)) * 180 / std::numbers::pi;
    const bool convex = glm::dot(n, apex(s) - surface.vertices[edge[0]]) <= 0;
    return convex ? 180 - turn : 180 + turn;
}

} // namespace

void add_incidence(const FeatureGraph& graph, const CleanSurface& surface, Domain& domain) {
    const EdgeSides sides = find_sides(graph, surface);
    domain.curve_patch.offset.assign(1, 0);
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        std::vector<Index> patches;
        CurveAngle angle{360, 0};
        bool open = false;
        for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
            const auto [low, high] = std::minmax(chain[i], chain[i + 1]);
            const std::vector<EdgeSide>& beside = sides.at({low, high});
            for (const EdgeSide& side : beside) patches.push_back(side.patch);
            if (beside.size() != 2) {
                open = true;
                continue;
            }
            const double theta =
                interior_angle_deg(surface, {low, high}, beside[0].triangle, beside[1].triangle);
            angle.smallest = std::min(angle.smallest, theta);
            angle.largest = std::max(angle.largest, theta);
        }
        std::sort(patches.begin(), patches.end());
        patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
        domain.curve_patch.item.insert(domain.curve_patch.item.end(), patches.begin(), patches.end());
        domain.curve_patch.offset.push_back(domain.curve_patch.item.size());
        domain.curve_open.push_back(open);
        domain.angle.push_back(angle.smallest > angle.largest ? CurveAngle{} : angle);
    }
    std::vector<std::vector<Index>> at(domain.model.corner_count());
    for (Index c = 0; c < domain.model.curve_count(); ++c)
        for (Index corner : domain.model.curve_ends(c))
            if (corner != kNoIndex) at[corner].push_back(c);
    domain.corner_curve.offset.assign(1, 0);
    for (const std::vector<Index>& curves : at) {
        domain.corner_curve.item.insert(domain.corner_curve.item.end(), curves.begin(), curves.end());
        domain.corner_curve.offset.push_back(domain.corner_curve.item.size());
    }
}

void add_names(std::span<const Index> source_name, Domain& domain) {
    const BoundaryModel& model = domain.model;
    domain.patch_name.assign(model.patch_count(), kNoIndex);
    bool several = false;
    for (Index p = 0; p < model.patch_count(); ++p) {
        const auto [first, last] = model.patch_triangles(p);
        for (Index t = first; t < last; ++t) {
            const Index name = source_name[model.source_face(t)];
            several = several || (t > first && name != domain.patch_name[p]);
            domain.patch_name[p] = std::min(domain.patch_name[p], name);
        }
    }
    if (!several) return;
    domain.triangle_name.resize(model.triangle_count());
    for (Index t = 0; t < model.triangle_count(); ++t)
        domain.triangle_name[t] = source_name[model.source_face(t)];
}

Result<Domain> build_domain(const TriangleSoup& surface, const BoundaryOptions& options, Context& context,
                            std::span<const std::array<Index, 2>> features) {
    if (Status ok = check_options(options); !ok) return ok.error();
    Result<CleanSurface> clean = clean_surface(surface);
    if (!clean) return clean.error();
    const std::vector<std::array<Index, 2>> given = merge_edges(surface.vertices, features);
    FeatureLimits limits = feature_limits(options);
    limits.given = given;
    const FeatureGraph graph = compute_feature_graph(clean->vertices, clean->polygons, limits);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "surface", "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = clean->vertices;
    parts.triangles = clean->triangles;
    parts.source.resize(parts.triangles.size());
    std::iota(parts.source.begin(), parts.source.end(), SourceFace{0});
    add_features(graph, parts);
    parts.source = clean->source;
    Domain domain;
    domain.model = BoundaryModelBuilder::assemble(std::move(parts));
    add_incidence(graph, *clean, domain);
    domain.names = surface.patch.empty() ? std::vector<std::string>{"surface"} : surface.patch_names;
    add_names(surface.patch.empty() ? std::vector<Index>(surface.triangles.size(), 0) : surface.patch,
              domain);
    for (Index name = 0; name < domain.names.size(); ++name)
        domain.name_group.push_back(options.patch_borders ? surface.group_of(name) : 0);
    domain.dropped_triangles = clean->dropped_triangles;
    domain.open_edges = clean->open_edges;
    domain.nonmanifold_edges = clean->nonmanifold_edges;
    return domain;
}

} // namespace hexopt
