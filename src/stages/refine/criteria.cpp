#include "stages/refine/criteria.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

Goal finer_by(const Goal& goal, int levels) {
    return goal.level >= 0 ? Goal{0, goal.level + levels} : Goal{std::ldexp(goal.size, -levels), -1};
}

Goal goal_of(const TargetSize& target) { return {target.level >= 0 ? 0 : target.size, target.level}; }

double angle_deg(const Point& a, const Point& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / std::numbers::pi;
}

/// Largest angle between unit vectors: all pairs of a few, else two sweeps (never below half of it).
double spread_deg(const std::vector<Point>& normals) {
    double widest = 0;
    if (normals.size() <= 24) {
        for (std::size_t i = 0; i < normals.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) widest = std::max(widest, angle_deg(normals[i], normals[j]));
        return widest;
    }
    Point from = normals[0];
    for (int sweep = 0; sweep < 2; ++sweep) {
        Point farthest = from;
        for (const Point& n : normals)
            if (const double angle = angle_deg(from, n); angle > widest) widest = angle, farthest = n;
        from = farthest;
    }
    return widest;
}

} // namespace

Result<SurfaceCriteria> SurfaceCriteria::create(const Domain& domain, const RefineOptions& options,
                                                const TargetSize& surface) {
    SurfaceCriteria criteria(domain);
    criteria.normal_angle_deg_ = options.normal_angle_deg;
    criteria.goal_.assign(domain.model.patch_count(), goal_of(surface));
    for (const PatchTarget& entry : options.patches) {
        bool found = false;
        for (Index patch = 0; patch < domain.model.patch_count(); ++patch) {
            const Index name = domain.patch_name[patch];
            if (name == kNoIndex || domain.names[name] != entry.patch) continue;
            criteria.goal_[patch] = goal_of(entry.target);
            found = true;
        }
        if (!found)
            return make_error(ErrorCode::usage, "refine", "patch '" + entry.patch + "'",
                              "the surface has no patch of this name");
    }
    for (const Goal& goal : criteria.goal_)
        criteria.finest_.push_back(finer_by(goal, options.curvature_levels));
    return criteria;
}

RefineCriterion SurfaceCriteria::ask(const CellRefinement& refinement, Index node,
                                     std::span<const Index> elements, const SurfaceElements& surface) const {
    if (wants_size(refinement, node, elements, surface)) return RefineCriterion::surface_size;
    if (wants_normals(refinement, node, elements, surface)) return RefineCriterion::normal_angle;
    return RefineCriterion::count;
}

bool SurfaceCriteria::wants_size(const CellRefinement& refinement, Index node,
                                 std::span<const Index> elements, const SurfaceElements& surface) const {
    const double size = node_size(refinement, node);
    const int depth = refinement.node(node).depth();
    return std::any_of(elements.begin(), elements.end(), [&](Index element) {
        return surface.is_triangle(element) &&
               goal_[surface.model().patch_of_triangle(element)].wants_split(size, depth);
    });
}

bool SurfaceCriteria::wants_normals(const CellRefinement& refinement, Index node,
                                    std::span<const Index> elements, const SurfaceElements& surface) const {
    if (normal_angle_deg_ >= 180) return false;
    const double size = node_size(refinement, node);
    const int depth = refinement.node(node).depth();
    std::vector<Index> open;
    for (Index element : elements)
        if (surface.is_triangle(element) &&
            finest_[surface.model().patch_of_triangle(element)].wants_split(size, depth))
            open.push_back(element);
    return !open.empty() && normal_spread_deg(node_box(refinement, node), open, surface) > normal_angle_deg_;
}

double SurfaceCriteria::normal_spread_deg(const Box& box, std::span<const Index> elements,
                                          const SurfaceElements& surface) const {
    std::vector<std::pair<Index, Index>> by_patch; // patch, triangle
    for (Index element : elements)
        if (surface.is_triangle(element))
            by_patch.emplace_back(surface.model().patch_of_triangle(element), element);
    std::sort(by_patch.begin(), by_patch.end());
    double widest = 0;
    std::vector<Point> normals;
    for (std::size_t i = 0; i < by_patch.size(); ++i) {
        const Index triangle = by_patch[i].second;
        const std::array<Point, 3>& at_corner = surface.model().vertex_normals(triangle);
        const ClippedTriangle part = clip_triangle(surface.model().triangle(triangle), box);
        for (int k = 0; k < part.count; ++k) {
            const auto& w = part.weight[k];
            const Point n = w[0] * at_corner[0] + w[1] * at_corner[1] + w[2] * at_corner[2];
            if (const double length = glm::length(n); length > 0.1) normals.push_back(n / length);
        }
        if (i + 1 < by_patch.size() && by_patch[i + 1].first == by_patch[i].first) continue;
        if (!normals.empty()) widest = std::max(widest, spread_deg(normals));
        normals.clear();
    }
    return widest;
}

} // namespace hexopt
