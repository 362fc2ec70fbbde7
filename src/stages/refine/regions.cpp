#include "stages/refine/regions.hpp"

#include "stages/refine/region_surface.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Distances to filled shapes; 0 inside.
double box_distance(const Box& box, const Point& x) {
    return glm::length(glm::max(glm::max(box.low - x, x - box.high), Point(0)));
}

double cylinder_distance(const Point& from, const Point& to, double radius, const Point& x) {
    const double length = glm::distance(from, to);
    const Point axis = (to - from) / length;
    const double along = glm::dot(x - from, axis);
    const double beyond = std::max({0.0, -along, along - length});
    const double outside = std::max(0.0, glm::length(x - from - along * axis) - radius);
    return std::hypot(beyond, outside);
}

bool is_finite(const Point& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// What is wrong with a region; empty if nothing is.
const char* find_fault(const RegionTarget& region) {
    if (region.sizes && region.target.is_given()) return "has one size and three: give either";
    if (!region.sizes && !region.target.is_given()) return "has no target size";
    if (region.sizes)
        for (double size : *region.sizes)
            if (!(size > 0) || !std::isfinite(size)) return "sizes must be positive and finite";
    if (!(region.distance >= 0) || !std::isfinite(region.distance))
        return "distance must be finite, not negative";
    if (!is_finite(region.low) || !is_finite(region.high) || !std::isfinite(region.radius))
        return "coordinates must be finite";
    switch (region.shape) {
    case RegionShape::box:
        for (int d = 0; d < 3; ++d)
            if (!(region.low[d] <= region.high[d])) return "box: a lower bound lies above the upper one";
        break;
    case RegionShape::sphere:
        if (!(region.radius > 0)) return "sphere: radius must be positive";
        break;
    case RegionShape::cylinder:
        if (!(region.radius > 0)) return "cylinder: radius must be positive";
        if (region.low == region.high) return "cylinder: the ends of its axis are the same point";
        break;
    case RegionShape::patch:
        break;
    case RegionShape::inside:
    case RegionShape::near:
        if (!region.surface) return "has no surface";
        break;
    }
    return "";
}

} // namespace

Result<Regions> Regions::create(const Domain& domain, const RefineOptions& options) {
    Regions regions(domain, options.frame);
    for (std::size_t r = 0; r < options.regions.size(); ++r) {
        const RegionTarget& target = options.regions[r];
        const std::string where = "region " + std::to_string(r + 1);
        if (const std::string fault = find_fault(target); !fault.empty())
            return make_error(ErrorCode::usage, "refine", where, fault);
        if (target.shape == RegionShape::inside && !target.surface->is_closed())
            return make_error(
                ErrorCode::bad_input, "refine",
                target.file.empty() ? where : where + " (" + target.file + ")",
                "the surface has " + std::to_string(target.surface->open_edges()) +
                    " open edges and encloses nothing; close it, or give 'near' with a distance");
        // Down to the largest of three sizes cells stay alike; what is left is axes_to_split()'s.
        const Goal goal = target.sizes
                              ? Goal{*std::max_element(target.sizes->begin(), target.sizes->end()), -1}
                              : goal_of(target.target);
        Region region{target, goal, {}};
        if (target.shape == RegionShape::patch && !target.patch.empty()) {
            region.patches = patches_of_name(domain, target.patch);
            if (region.patches.empty())
                return make_error(ErrorCode::usage, "refine", where,
                                  "the surface has no patch '" + target.patch + "'");
        } else {
            region.patches = {kNoIndex};
        }
        regions.regions_.push_back(std::move(region));
    }
    return regions;
}

double Regions::distance(const Region& region, const Point& at, double reach) const {
    const RegionTarget& target = region.target;
    const Point in_model = frame_.to_model(at);
    switch (target.shape) {
    case RegionShape::box:
        return box_distance({target.low, target.high}, in_model);
    case RegionShape::sphere:
        return std::max(0.0, glm::distance(target.low, in_model) - target.radius);
    case RegionShape::cylinder:
        return cylinder_distance(target.low, target.high, target.radius, in_model);
    default:
        break;
    }
    double nearest = reach;
    for (Index patch : region.patches)
        nearest = std::min(nearest, domain_->model.project_patch(patch, at).distance);
    return nearest;
}

bool Regions::may_meet(const Region& region, const Point& at, double half) const {
    const RegionTarget& target = region.target;
    const double reach = target.distance + half;
    const Point in_model = frame_.to_model(at);
    if (target.shape == RegionShape::near) return target.surface->is_near(in_model, reach);
    if (target.shape == RegionShape::inside)
        return target.surface->is_inside(in_model) || target.surface->is_near(in_model, reach);
    return distance(region, at, 2 * reach) <= reach;
}

bool Regions::has_axes() const {
    return std::any_of(regions_.begin(), regions_.end(),
                       [](const Region& region) { return region.target.sizes.has_value(); });
}

AxisMask Regions::axes_to_split(const CellRefinement& refinement, Index node) const {
    const Box box = node_box(refinement, node);
    const double half = glm::distance(box.low, box.high) / 2;
    AxisMask axes = 0;
    for (const Region& region : regions_) {
        if (!region.target.sizes) continue;
        AxisMask larger = 0;
        for (int d = 0; d < 3; ++d) {
            const auto axis = static_cast<AxisMask>(1 << d);
            if (node_size(refinement, node, axis) > (*region.target.sizes)[d] * (1 + 1e-6)) larger |= axis;
        }
        if ((larger & ~axes) != 0 && may_meet(region, box.centre(), half)) axes |= larger;
    }
    return axes;
}

bool Regions::wants_split(const CellRefinement& refinement, Index node, AxisMask mask) const {
    const Box box = node_box(refinement, node);
    const double size = node_size(refinement, node, mask), half = glm::distance(box.low, box.high) / 2;
    const int depth = refinement.node(node).depth();
    return std::any_of(regions_.begin(), regions_.end(), [&](const Region& region) {
        return region.goal.wants_split(size, depth) && may_meet(region, box.centre(), half);
    });
}

} // namespace hexopt
