#include "stages/refine/criteria.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/refine/outer_box.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

namespace hexopt {

namespace {

/// Triangles of a cell from which gaps are looked for; where there are more, evenly many are left out.
constexpr std::size_t kProbes = 8;
/// Cells whose size is a level are taken to be no larger than this part of the diagonal where creases are
/// sought.
constexpr double kLargestSize_rel = 0.1;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Goal finer_by(const Goal& goal, int levels) {
    return goal.level >= 0 ? Goal{0, goal.level + levels} : Goal{std::ldexp(goal.size, -levels), -1};
}

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

Error unknown_patch(const std::string& name) {
    return make_error(ErrorCode::usage, "refine", "patch '" + name + "'",
                      "the surface has no patch of this name");
}

Error no_common_feature(const CurveTarget& entry) {
    const auto text = [](const std::string& name) { return name.empty() ? "*" : name; };
    return make_error(ErrorCode::usage, "refine",
                      fmt::format("curve '{} {}'", text(entry.patch), text(entry.other_patch)),
                      "no feature of the surface lies between these patches");
}

bool is_called(const Domain& domain, Index patch, const std::string& name) {
    const auto matches = [&](Index at) { return at != kNoIndex && domain.names[at] == name; };
    if (domain.triangle_name.empty()) return matches(domain.patch_name[patch]);
    const auto [first, last] = domain.model.patch_triangles(patch);
    const auto begin = domain.triangle_name.begin();
    return std::any_of(begin + first, begin + last, matches);
}

bool has_patch(const Domain& domain, Index curve, const std::string& name) {
    if (name.empty()) return true;
    const auto patches = domain.curve_patch[curve];
    return std::any_of(patches.begin(), patches.end(),
                       [&](Index patch) { return is_called(domain, patch, name); });
}

} // namespace

Goal goal_of(const TargetSize& target) { return {target.level >= 0 ? 0 : target.size, target.level}; }

std::vector<Index> patches_of_name(const Domain& domain, const std::string& name) {
    std::vector<Index> patches;
    for (Index patch = 0; patch < domain.model.patch_count(); ++patch)
        if (is_called(domain, patch, name)) patches.push_back(patch);
    return patches;
}

double node_size(const CellRefinement& refinement, Index node, AxisMask mask) {
    double longest = 0;
    const Cell& cell = refinement.node(node).vertices;
    for (std::size_t e = 0; e < 12; ++e) {
        if (!(mask >> e / 4 & 1)) continue;
        const auto& edge = hex::kEdgeVertex[e];
        const double length =
            glm::distance(refinement.position(cell[edge[0]]), refinement.position(cell[edge[1]]));
        longest = std::max(longest, length);
    }
    return longest;
}

SurfaceCriteria::SurfaceCriteria(const Domain& domain, const SurfaceElements& surface,
                                 const RefineOptions& options)
    : domain_(&domain), surface_(&surface), probe_(domain), closeness_(domain),
      normal_angle_deg_(options.normal_angle_deg),
      chord_error_(options.chord_error_rel * domain.model.diagonal()), gap_cells_(options.gap_cells),
      wall_cells_(options.wall_cells), feature_cells_(options.planar ? 0 : options.feature_cells) {
    if (options.surface.is_given()) return;
    in_outer_box_ = find_outer_box(domain, options.planar);
    if (in_outer_box_.empty()) return;
    for (Index patch = 0; patch < domain.model.patch_count(); ++patch) {
        const auto [first, last] = domain.model.patch_triangles(patch);
        all_outer_.push_back(std::all_of(in_outer_box_.begin() + first, in_outer_box_.begin() + last,
                                         [](std::uint8_t in) { return in != 0; }));
    }
}

Status SurfaceCriteria::set_size(const RefineOptions& options, const TargetSize& size) {
    given_up_ = {};
    finest_bend_.clear();
    finest_steep_.clear();
    finest_gap_.clear();
    curve_goal_.clear();
    goal_.assign(domain_->model.patch_count(), goal_of(size));
    if (!in_outer_box_.empty()) coarsen_outer_box(options);
    for (const PatchTarget& entry : options.patches) {
        const std::vector<Index> patches = patches_of_name(*domain_, entry.patch);
        if (patches.empty()) return unknown_patch(entry.patch);
        for (Index patch : patches)
            for (std::size_t zone = patch; zone < goal_.size(); zone += domain_->model.patch_count())
                goal_[zone] = goal_of(entry.target);
    }
    for (const Goal& goal : goal_) {
        finest_bend_.push_back(finer_by(goal, options.curvature_levels));
        finest_steep_.push_back(
            finer_by(goal, options.curvature_levels > 0 ? options.curvature_levels + 1 : 0));
        finest_gap_.push_back(finer_by(goal, options.gap_levels));
    }
    find_creases_in_patches();
    curve_goal_.resize(domain_->model.curve_count());
    for (const CurveTarget& entry : options.curves) {
        for (const std::string& name : {entry.patch, entry.other_patch})
            if (!name.empty() && patches_of_name(*domain_, name).empty()) return unknown_patch(name);
        bool any = entry.patch.empty() && entry.other_patch.empty();
        for (Index curve = 0; curve < curve_goal_.size(); ++curve) {
            if (!has_patch(*domain_, curve, entry.patch) || !has_patch(*domain_, curve, entry.other_patch))
                continue;
            any = true;
            curve_goal_[curve].push_back(goal_of(entry.target));
        }
        if (!any) return no_common_feature(entry);
    }
    return Done{};
}

std::vector<double> SurfaceCriteria::finest_sizes(double base) const {
    std::vector<double> sizes;
    for (Index patch = 0; patch < domain_->model.patch_count(); ++patch) {
        const Goal& goal = finest_gap_[zone_of_curve(patch)];
        sizes.push_back(goal.level >= 0 ? std::ldexp(base, -goal.level) : goal.size);
    }
    return sizes;
}

void SurfaceCriteria::coarsen_outer_box(const RefineOptions& options) {
    const std::vector<Goal> patches = goal_;
    for (const Goal& goal : patches) goal_.push_back(finer_by(goal, -options.outer_levels));
}

Index SurfaceCriteria::zone_of_triangle(Index triangle) const {
    const Index patch = domain_->model.patch_of_triangle(triangle);
    const bool outer = !in_outer_box_.empty() && in_outer_box_[triangle];
    return outer ? patch + static_cast<Index>(domain_->model.patch_count()) : patch;
}

Index SurfaceCriteria::zone_of_curve(Index patch) const {
    const bool outer = !all_outer_.empty() && all_outer_[patch];
    return outer ? patch + static_cast<Index>(domain_->model.patch_count()) : patch;
}

RefineCriterion SurfaceCriteria::ask(const CutCell& cell) const {
    for (std::size_t c = 0; c < kCriterionCount; ++c)
        if (!given_up_[c] && wants(static_cast<RefineCriterion>(c), cell))
            return static_cast<RefineCriterion>(c);
    return RefineCriterion::count;
}

bool SurfaceCriteria::wants(RefineCriterion criterion, const CutCell& cell) const {
    switch (criterion) {
    case RefineCriterion::surface_size:
        return wants_surface_size(cell);
    case RefineCriterion::curve_size:
        return wants_curve_size(cell);
    case RefineCriterion::normal_angle:
        return wants_normals(cell);
    case RefineCriterion::gap:
        return wants_gap(cell);
    case RefineCriterion::feature:
        return wants_feature(cell);
    case RefineCriterion::region:
    case RefineCriterion::count:
        break;
    }
    return false;
}

/// Whether the limits of the patches beside an element let the cell be split.
bool SurfaceCriteria::allows(const std::vector<Goal>& finest, const CutCell& cell, Index element) const {
    if (surface_->is_triangle(element))
        return finest[zone_of_triangle(element)].wants_split(cell.size, cell.depth);
    const Index curve = domain_->model.curve_of_segment(surface_->segment_of(element));
    const auto patches = domain_->curve_patch[curve];
    return std::any_of(patches.begin(), patches.end(), [&](Index patch) {
        return finest[zone_of_curve(patch)].wants_split(cell.size, cell.depth);
    });
}

/// Size of the smallest cells that gaps and features may get at an element; what is narrower than that cannot
/// be resolved and is left alone.
double SurfaceCriteria::finest_gap_size(const CutCell& cell, Index element) const {
    const auto size_for = [&](Index zone) {
        const Goal& goal = finest_gap_[zone];
        return goal.level >= 0 ? std::ldexp(cell.size, cell.depth - goal.level)
                               : std::min(goal.size, cell.size);
    };
    if (surface_->is_triangle(element)) return size_for(zone_of_triangle(element));
    double finest = cell.size;
    for (Index patch : domain_->curve_patch[domain_->model.curve_of_segment(surface_->segment_of(element))])
        finest = std::min(finest, size_for(zone_of_curve(patch)));
    return finest;
}

bool SurfaceCriteria::wants_surface_size(const CutCell& cell) const {
    return std::any_of(cell.elements.begin(), cell.elements.end(), [&](Index element) {
        return surface_->is_triangle(element) && allows(goal_, cell, element);
    });
}

bool SurfaceCriteria::wants_curve_size(const CutCell& cell) const {
    return std::any_of(cell.elements.begin(), cell.elements.end(), [&](Index element) {
        if (surface_->is_triangle(element)) return false;
        const auto& goals = curve_goal_[domain_->model.curve_of_segment(surface_->segment_of(element))];
        return std::any_of(goals.begin(), goals.end(),
                           [&](const Goal& goal) { return goal.wants_split(cell.size, cell.depth); });
    });
}

bool SurfaceCriteria::wants_normals(const CutCell& cell) const {
    if (turns_too_far(cell, finest_bend_, normal_angle_deg_, chord_error_)) return true;
    return steep_ > 0 && chord_error_ > 0 && turns_too_far(cell, finest_steep_, 180, steep_ * chord_error_);
}

bool SurfaceCriteria::turns_too_far(const CutCell& cell, const std::vector<Goal>& finest, double limit_deg,
                                    double chord_error) const {
    if (chord_error > 0)
        limit_deg = std::min(limit_deg, 8 * chord_error / cell.size * 180 / std::numbers::pi);
    if (crosses_crease(cell, finest, chord_error)) return true;
    if (limit_deg >= 180) return false;
    std::vector<Index> open;
    for (Index element : cell.elements)
        if (surface_->is_triangle(element) && allows(finest, cell, element)) open.push_back(element);
    return !open.empty() && normal_spread_deg(cell.box, open) > limit_deg;
}

/// A coarse tessellation turns at its edges, where quads that lie across leave it by more than they would
/// leave the smooth surface that it stands for.
void SurfaceCriteria::find_creases_in_patches() {
    const BoundaryModel& model = domain_->model;
    if (!(chord_error_ > 0)) return;
    double largest = 0;
    for (const Goal& goal : goal_) largest = std::max(largest, goal.level >= 0 ? kInfinity : goal.size);
    largest = std::min(largest, kLargestSize_rel * model.diagonal());
    creases_ = find_patch_creases(model, 4 * chord_error_ / largest, 0.5 * largest);
}

bool SurfaceCriteria::crosses_crease(const CutCell& cell, const std::vector<Goal>& finest,
                                     double chord_error) const {
    if (creases_.crease.empty()) return false;
    return std::any_of(cell.elements.begin(), cell.elements.end(), [&](Index triangle) {
        if (!surface_->is_triangle(triangle) || !allows(finest, cell, triangle)) return false;
        const auto creases = creases_.of_triangle[triangle];
        return std::any_of(creases.begin(), creases.end(), [&](Index c) {
            const auto& [a, b] = creases_.ends[c];
            return chord_distance(creases_.crease[c], cell.size) > chord_error &&
                   triangle_meets_box({a, b, b}, cell.box);
        });
    });
}

double SurfaceCriteria::normal_spread_deg(const Box& box, std::span<const Index> triangles) const {
    const BoundaryModel& model = domain_->model;
    std::vector<std::pair<Index, Index>> by_patch; // patch, triangle
    for (Index triangle : triangles) by_patch.emplace_back(model.patch_of_triangle(triangle), triangle);
    std::sort(by_patch.begin(), by_patch.end());
    double widest = 0;
    std::vector<Point> normals;
    for (std::size_t i = 0; i < by_patch.size(); ++i) {
        const Index triangle = by_patch[i].second;
        const std::array<Point, 3>& at_corner = model.vertex_normals(triangle);
        const ClippedTriangle part = clip_triangle(model.triangle(triangle), box);
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

bool SurfaceCriteria::wants_gap(const CutCell& cell) const {
    if (gap_cells_ == 0 && wall_cells_ == 0) return false;
    std::vector<Index> open;
    for (Index element : cell.elements)
        if (surface_->is_triangle(element) && allows(finest_gap_, cell, element)) open.push_back(element);
    const std::size_t step = std::max<std::size_t>(1, (open.size() + kProbes - 1) / kProbes);
    for (std::size_t i = 0; i < open.size(); i += step) {
        const auto& x = domain_->model.triangle(open[i]);
        const ClippedTriangle part = clip_triangle(x, cell.box);
        const Point cross = glm::cross(x[1] - x[0], x[2] - x[0]);
        const double length = glm::length(cross);
        if (part.count == 0 || !(length > 0)) continue;
        const Point normal = cross / length;
        Point from(0);
        for (int k = 0; k < part.count; ++k)
            for (int v = 0; v < 3; ++v) from += part.weight[k][v] / part.count * x[v];
        const double gap = gap_cells_ * cell.size * (1 - 1e-6), wall = wall_cells_ * cell.size * (1 - 1e-6);
        const double finest = finest_gap_size(cell, open[i]);
        const auto is_narrow = [&](const Point& direction, double least) {
            if (least == 0) return false;
            const double width = probe_.distance(from, direction, normal, least);
            return width < least && width >= finest;
        };
        if (is_narrow(-normal, gap) || is_narrow(normal, wall)) return true;
    }
    return false;
}

bool SurfaceCriteria::wants_feature(const CutCell& cell) const {
    if (feature_cells_ == 0) return false;
    const double least = feature_cells_ * cell.size * (1 - 1e-6);
    return std::any_of(cell.elements.begin(), cell.elements.end(), [&](Index element) {
        if (!allows(finest_gap_, cell, element)) return false;
        const double width = surface_->is_triangle(element)
                                 ? closeness_.patch_width(domain_->model.patch_of_triangle(element))
                                 : curve_room(cell, surface_->segment_of(element), least);
        return width < least && width >= finest_gap_size(cell, element);
    });
}

/// Length of a curve, or the distance from its part in the cell to another curve where that is shorter.
double SurfaceCriteria::curve_room(const CutCell& cell, Index segment, double reach) const {
    const Index curve = domain_->model.curve_of_segment(segment);
    const double length = closeness_.curve_length(curve);
    if (length < reach) return length;
    const auto& ends = domain_->model.segment(segment);
    const ClippedTriangle part = clip_triangle({ends[0], ends[1], ends[1]}, cell.box);
    if (part.count == 0) return reach;
    double first = 1, last = 0; // along the segment
    for (int k = 0; k < part.count; ++k) {
        first = std::min(first, 1 - part.weight[k][0]);
        last = std::max(last, 1 - part.weight[k][0]);
    }
    const Point middle = ends[0] + (first + last) / 2 * (ends[1] - ends[0]);
    return closeness_.other_curve(curve, middle, reach);
}

} // namespace hexopt
