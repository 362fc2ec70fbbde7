#include "domain/domain.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace hexopt {

namespace {

using Description = DomainDescription;

/// Triangles of a patch in the order in which the model was built from them.
std::vector<Index> given_order(const BoundaryModel& model, Index patch) {
    const auto [first, last] = model.patch_triangles(patch);
    std::vector<Index> order(last - first);
    std::iota(order.begin(), order.end(), first);
    std::sort(order.begin(), order.end(),
              [&](Index a, Index b) { return model.source_face(a) < model.source_face(b); });
    return order;
}

struct LessPoint {
    bool operator()(const Point& a, const Point& b) const {
        for (int k = 0; k < 3; ++k)
            if (a[k] != b[k]) return a[k] < b[k];
        return false;
    }
};

Description::Surface describe_surface(const BoundaryModel& model, const std::vector<Index>& triangles) {
    Description::Surface surface;
    std::map<Point, Index, LessPoint> number;
    for (Index t : triangles) {
        std::array<Index, 3> ids{};
        for (int k = 0; k < 3; ++k) {
            const Point& p = model.triangle(t)[static_cast<std::size_t>(k)];
            const auto [entry, is_new] = number.try_emplace(p, static_cast<Index>(surface.points.size()));
            if (is_new) surface.points.push_back(p);
            ids[static_cast<std::size_t>(k)] = entry->second;
        }
        surface.triangles.push_back(ids);
    }
    return surface;
}

/// Each patch as one surface a name. Returns the (first) number of each.
std::vector<std::int64_t> describe_patches(const Domain& domain, Description& out) {
    std::vector<std::int64_t> number;
    for (Index p = 0; p < domain.model.patch_count(); ++p) {
        std::map<Index, std::vector<Index>> by_name;
        for (Index t : given_order(domain.model, p))
            by_name[domain.triangle_name.empty() ? domain.patch_name[p] : domain.triangle_name[t]].push_back(
                t);
        number.push_back(static_cast<std::int64_t>(out.patches.size()) + 1);
        for (const auto& [name, triangles] : by_name) {
            Description::Patch patch;
            patch.number = static_cast<std::int64_t>(out.patches.size()) + 1;
            patch.name = domain.names[name];
            patch.surfaces = {patch.number};
            out.patches.push_back(std::move(patch));
            out.surfaces.push_back(describe_surface(domain.model, triangles));
            out.surfaces.back().number = out.patches.back().number;
        }
    }
    return number;
}

void describe_curves(const Domain& domain, const std::vector<std::int64_t>& patch_number, Description& out) {
    const BoundaryModel& model = domain.model;
    for (Index c = 0; c < model.curve_count(); ++c) {
        Description::Curve curve;
        curve.number = std::int64_t{c} + 1;
        if (const auto [from, to] = model.curve_ends(c); from != kNoIndex)
            curve.ends = {std::int64_t{from} + 1, std::int64_t{to} + 1};
        for (Index patch : domain.curve_patch[c]) curve.patches.push_back(patch_number[patch]);
        curve.open = domain.curve_open[c] != 0;
        curve.angle_deg = {domain.angle[c].smallest, domain.angle[c].largest};
        curve.polylines = {curve.number};
        out.curves.push_back(std::move(curve));
        Description::Polyline polyline;
        polyline.number = std::int64_t{c} + 1;
        const std::span<const Point> points = model.curve_points(c);
        polyline.points.assign(points.begin(), points.end());
        out.polylines.push_back(std::move(polyline));
    }
}

} // namespace

DomainDescription describe_domain(const Domain& domain) {
    Description out;
    out.names = domain.names;
    for (Index c = 0; c < domain.model.corner_count(); ++c) {
        Description::Corner corner;
        corner.number = std::int64_t{c} + 1;
        corner.position = domain.model.corner_point(c);
        corner.alone = domain.corner_curve[c].empty();
        out.corners.push_back(corner);
    }
    describe_curves(domain, describe_patches(domain, out), out);
    return out;
}

} // namespace hexopt
