#include "pipeline/prepare_domain.hpp"

#include "domain/surface_creases.hpp"
#include "domain/surface_polygons.hpp"
#include "pipeline/seeded_surface.hpp"

#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <set>

namespace hexopt {

namespace {

/// The surface inside a box, whose sides are six patches more.
TriangleSoup add_farfield(TriangleSoup surface, const Box& box) {
    static constexpr const char* kNames[6] = {"farfield_x_min", "farfield_x_max", "farfield_y_min",
                                              "farfield_y_max", "farfield_z_min", "farfield_z_max"};
    static constexpr Index kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    if (surface.patch.empty()) {
        surface.patch.assign(surface.triangles.size(), 0);
        surface.patch_names = {"surface"};
    }
    const Index first = static_cast<Index>(surface.vertices.size());
    for (int i = 0; i < 8; ++i)
        surface.vertices.emplace_back(i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y,
                                      i & 4 ? box.high.z : box.low.z);
    for (int f = 0; f < 6; ++f) {
        const auto& side = kSides[f];
        for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
            surface.triangles.push_back({first + side[a], first + side[b], first + side[c]});
            surface.patch.push_back(static_cast<Index>(surface.patch_names.size()));
        }
        if (!surface.patch_group.empty())
            surface.patch_group.push_back(static_cast<Index>(surface.patch_names.size()));
        surface.patch_names.emplace_back(kNames[f]);
    }
    return surface;
}

Status check_farfield(const TriangleSoup& surface, const Box& box) {
    if (!std::isfinite(box.low.z) || !std::isfinite(box.high.z))
        return make_error(ErrorCode::usage, "farfield", "",
                          "four numbers are for planar meshes: give xmin,ymin,zmin,xmax,ymax,zmax");
    for (int k = 0; k < 3; ++k)
        if (!(box.low[k] < box.high[k]))
            return make_error(ErrorCode::usage, "farfield", "",
                              "the box is empty: give xmin,ymin,zmin,xmax,ymax,zmax");
    for (const Point& p : surface.vertices)
        for (int k = 0; k < 3; ++k)
            if (!(p[k] > box.low[k] && p[k] < box.high[k]))
                return make_error(
                    ErrorCode::usage, "farfield", "",
                    fmt::format("the point ({:.6g}, {:.6g}, {:.6g}) of the surface is not inside the box",
                                p.x, p.y, p.z));
    return Done{};
}

Result<FeaturedSurface> add_feature_lines(TriangleSoup soup, const MeshOptions& options, StageClock& clock,
                                          Context& context) {
    if (!(options.feature_reach_rel >= 0 && options.feature_reach_rel <= 0.01))
        return make_error(ErrorCode::usage, "features", "", "the reach of features must lie in 0..0.01");
    if (options.feature_lines.empty()) return FeaturedSurface{std::move(soup), {}, 0};
    return clock.run("features", [&] {
        return insert_features(soup, options.feature_lines,
                               options.feature_reach_rel * compute_diagonal(soup), context);
    });
}

/// Size of the cells at the surface as far as it is known before there is a mesh, model units; 0: not known.
double expect_cell_size(const TriangleSoup& soup, const RefineOptions& refine) {
    /// Cells of a finished mesh for each quad of its boundary: 3 to 4.5 on real models.
    constexpr double kCellsPerQuad = 3.5;
    if (refine.surface.is_given()) return refine.surface.size;
    double area = 0;
    for (const auto& [a, b, c] : soup.triangles)
        area += 0.5 * glm::length(glm::cross(soup.vertices[b] - soup.vertices[a],
                                             soup.vertices[c] - soup.vertices[a]));
    return std::sqrt(kCellsPerQuad * area / wanted_cells(refine));
}

/// Of the chord error, beyond which quads across a crease need its edges to follow it: what is little more,
/// vertices that move onto creases at the end mend, and facets of round shapes need no edges of their own.
constexpr double kWeakShare = 1.5;

/// Adds creases that are no features by angle but that quads across them would not follow.
Status add_weak_creases(const MeshOptions& options, FeaturedSurface& featured) {
    const RefineOptions& refine = options.refine;
    if (!options.weak_features || !(refine.chord_error_rel > 0)) return Done{};
    auto creases = find_weak_creases(featured.soup, options.features,
                                     {expect_cell_size(featured.soup, refine),
                                      kWeakShare * refine.chord_error_rel * compute_diagonal(featured.soup)});
    if (!creases) return creases.error();
    featured.edges.insert(featured.edges.end(), creases->begin(), creases->end());
    return Done{};
}

/// Whether several patches count as one where their borders are concerned.
bool has_groups(const TriangleSoup& soup) {
    const std::set<Index> groups(soup.patch_group.begin(), soup.patch_group.end());
    return groups.size() < soup.patch_group.size();
}

} // namespace

Result<PreparedDomain> prepare_domain(const TriangleSoup& surface, const MeshOptions& options,
                                      StageClock& clock, Context& context) {
    if (!(options.weld_rel >= 0 && options.weld_rel <= 0.01))
        return make_error(ErrorCode::usage, "weld", "", "the gaps to close must lie in 0..0.01");
    if (options.farfield)
        if (Status ok = check_farfield(surface, *options.farfield); !ok) return ok.error();
    PreparedDomain prepared;
    auto welded = clock.run(
        "weld", [&] { return weld_surface(surface, options.weld_rel * compute_diagonal(surface), context); });
    if (!welded) return welded.error();
    prepared.weld = welded->report;
    if (options.farfield) welded->soup = add_farfield(std::move(welded->soup), *options.farfield);
    if (!options.trim.seeds.empty()) {
        auto seeded = clock.run(
            "seeds", [&] { return keep_around_seeds(std::move(welded->soup), options.trim.seeds, context); });
        if (!seeded) return seeded.error();
        prepared.left_out_bodies = seeded->left_out_bodies;
        welded->soup = std::move(seeded->soup);
    }
    auto oriented = clock.run("orient", [&] { return orient_surface(welded->soup, context); });
    if (!oriented) return oriented.error();
    prepared.orientation = oriented->report;
    auto featured = add_feature_lines(std::move(oriented->soup), options, clock, context);
    if (!featured) return featured.error();
    prepared.feature_triangles = featured->cut_triangles;
    if (Status ok = clock.run("weak_features", [&] { return add_weak_creases(options, *featured); }); !ok)
        return ok.error();
    auto domain = clock.run(
        "domain", [&] { return build_domain(featured->soup, options.features, context, featured->edges); });
    if (!domain) return domain.error();
    prepared.domain = std::move(*domain);
    if (options.weak_features && has_groups(featured->soup)) prepared.bordered = std::move(*featured);
    return prepared;
}

} // namespace hexopt
