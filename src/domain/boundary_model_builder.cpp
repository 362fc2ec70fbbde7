#include "domain/boundary_model_builder.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

Point unit_or_zero(const Point& v) {
    const double length = glm::length(v);
    return length > 0 ? v / length : Point(0);
}

double angle_at(const Point& apex, const Point& a, const Point& b) {
    const Point u = a - apex, v = b - apex;
    return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
}

/// Triangles by patch, in their given order within one.
Csr<Index> group_by_patch(const BoundaryModelParts& parts) {
    Csr<Index> csr;
    csr.offset.assign(parts.patch_count + 1, 0);
    for (Index p : parts.patch) ++csr.offset[p + 1];
    std::partial_sum(csr.offset.begin(), csr.offset.end(), csr.offset.begin());
    csr.item.resize(parts.patch.size());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for (Index t = 0; t < parts.patch.size(); ++t) csr.item[next[parts.patch[t]]++] = t;
    return csr;
}

/// Sums angle-weighted normals of one patch at its vertices; `sum` is zero elsewhere and on return to it.
class VertexNormals {
  public:
    explicit VertexNormals(const BoundaryModelParts& parts)
        : parts_(parts), sum_(parts.smooth ? parts.vertices.size() : 0, Point(0)) {}

    void start(std::span<const Index> triangles) {
        for (Index t : triangles)
            for (Index v : parts_.triangles[t]) sum_[v] = Point(0);
        for (Index t : triangles) {
            const std::array<Index, 3>& v = parts_.triangles[t];
            const std::array<Point, 3> x = {parts_.vertices[v[0]], parts_.vertices[v[1]],
                                            parts_.vertices[v[2]]};
            const Point normal = unit_or_zero(glm::cross(x[1] - x[0], x[2] - x[0]));
            for (int k = 0; k < 3; ++k) sum_[v[k]] += angle_at(x[k], x[(k + 1) % 3], x[(k + 2) % 3]) * normal;
        }
    }
    Point operator[](Index v) const {
        const std::size_t first_inside = parts_.vertices.size() - parts_.inside.size();
        if (v < first_inside) return unit_or_zero(sum_[v]);
        const BoundaryModelParts::Inside& inside = parts_.inside[v - first_inside];
        Point blended(0);
        for (int k = 0; k < 4; ++k) blended += inside.weight[k] * unit_or_zero(sum_[inside.corners[k]]);
        return unit_or_zero(blended);
    }

  private:
    const BoundaryModelParts& parts_;
    std::vector<Point> sum_;
};

/// Tangents at the points of a curve: mean of the segments beside; one-sided at ends unless it is a smooth
/// loop.
std::vector<Point> compute_tangents(std::span<const Point> points, bool smooth_loop) {
    std::vector<Point> tangent(points.size(), Point(0));
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const Point t = unit_or_zero(points[i + 1] - points[i]);
        tangent[i] += t;
        tangent[i + 1] += t;
    }
    if (smooth_loop) tangent.front() = tangent.back() = tangent.front() + tangent.back();
    for (Point& t : tangent) t = unit_or_zero(t);
    return tangent;
}

} // namespace

void BoundaryModelBuilder::add_patches(const BoundaryModelParts& parts, BoundaryModel& model,
                                       const Box& frame) {
    const Csr<Index> by_patch = group_by_patch(parts);
    const std::size_t count = parts.triangles.size();
    model.triangle_tree_ = BoxTree(frame);
    VertexNormals normals(parts);
    std::vector<Box> patch_box;
    std::vector<Index> roots, order, in_patch;
    order.reserve(count);
    for (Index p = 0; p < parts.patch_count; ++p) {
        const std::span<const Index> triangles = by_patch[p];
        std::vector<Box> boxes(triangles.size());
        Box patch;
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            for (Index v : parts.triangles[triangles[i]]) boxes[i].add(parts.vertices[v]);
            patch.add(boxes[i]);
        }
        roots.push_back(model.triangle_tree_.add_tree(boxes, static_cast<Index>(order.size()), in_patch));
        patch_box.push_back(patch);
        for (Index k : in_patch) order.push_back(triangles[k]);
    }
    // Only once all boxes are gone: triangles are most of the memory.
    model.triangles_.reserve(count);
    if (parts.smooth) model.triangle_vertex_normal_.reserve(count);
    model.source_.reserve(count);
    model.patch_of_triangle_.reserve(count);
    for (Index p = 0; p < parts.patch_count; ++p) {
        const auto first = static_cast<Index>(model.triangles_.size());
        if (parts.smooth) normals.start(by_patch[p]);
        for (Index t : std::span(order).subspan(first, by_patch[p].size())) {
            const std::array<Index, 3>& v = parts.triangles[t];
            const Point a = parts.vertices[v[0]], b = parts.vertices[v[1]], c = parts.vertices[v[2]];
            model.triangles_.push_back({{a, b, c}, unit_or_zero(glm::cross(b - a, c - a))});
            if (parts.smooth)
                model.triangle_vertex_normal_.push_back({normals[v[0]], normals[v[1]], normals[v[2]]});
            model.source_.push_back(parts.source[t]);
            model.patch_of_triangle_.push_back(p);
        }
        model.patches_.push_back({{first, static_cast<Index>(model.triangles_.size())}, roots[p]});
    }
    model.all_triangles_ = model.triangle_tree_.add_tree_of_trees(patch_box, roots);
}

void BoundaryModelBuilder::add_curves(const BoundaryModelParts& parts, BoundaryModel& model,
                                      const Box& frame) {
    model.segment_tree_ = BoxTree(frame);
    std::vector<Box> curve_box;
    std::vector<Index> roots, order;
    for (Index v : parts.curve_vertex.item) model.curve_points_.item.push_back(parts.vertices[v]);
    model.curve_points_.offset = parts.curve_vertex.offset;
    for (std::size_t c = 0; c < parts.curve_vertex.rows(); ++c) {
        const std::span<const Point> points = model.curve_points_[c];
        const std::span<const Index> chain = parts.curve_vertex[c];
        const std::vector<Point> tangent = compute_tangents(points, parts.curve_ends[c][0] == kNoIndex);
        std::vector<Box> boxes(points.size() - 1);
        Box curve;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            boxes[i].add(points[i]);
            boxes[i].add(points[i + 1]);
            curve.add(boxes[i]);
        }
        const auto first = static_cast<Index>(model.segments_.size());
        roots.push_back(model.segment_tree_.add_tree(boxes, first, order));
        curve_box.push_back(curve);
        for (Index k : order) {
            model.segments_.push_back({{points[k], points[k + 1]}, unit_or_zero(points[k + 1] - points[k])});
            model.segment_vertex_tangent_.push_back({tangent[k], tangent[k + 1]});
            model.curve_of_segment_.push_back(static_cast<Index>(c));
        }
        model.curves_.push_back({{first, static_cast<Index>(model.segments_.size())},
                                 roots.back(),
                                 chain.front() == chain.back(),
                                 parts.curve_ends[c]});
    }
    if (!roots.empty()) model.all_segments_ = model.segment_tree_.add_tree_of_trees(curve_box, roots);
}

BoundaryModel BoundaryModelBuilder::assemble(BoundaryModelParts parts) {
    BoundaryModel model;
    Box frame;
    for (const auto& triangle : parts.triangles)
        for (Index v : triangle) frame.add(parts.vertices[v]);
    model.diagonal_ = glm::length(frame.high - frame.low);
    add_patches(parts, model, frame);
    add_curves(parts, model, frame);
    for (Index v : parts.corner_vertex) model.corners_.push_back(parts.vertices[v]);
    return model;
}

void BoundaryModelBuilder::bind(BoundaryModel& model, std::vector<Association> association,
                                std::vector<std::array<Index, 2>> feature_edges, AssociationReport report,
                                double quad_tolerance) {
    model.association_ = std::move(association);
    model.feature_edges_ = std::move(feature_edges);
    model.report_ = std::move(report);
    model.quad_tolerance_ = quad_tolerance;
}

void add_features(const FeatureGraph& graph, BoundaryModelParts& parts) {
    for (std::size_t t = 0; t < parts.triangles.size(); ++t) {
        parts.patch.push_back(graph.face_patch[parts.source[t]]);
        if (graph.flipped[parts.source[t]]) std::swap(parts.triangles[t][0], parts.triangles[t][1]);
    }
    parts.patch_count = graph.patch_count;
    parts.curve_vertex = graph.curve_vertex;
    parts.corner_vertex = graph.corner_vertex;
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        parts.curve_ends.push_back({graph.vertex_corner[chain.front()], graph.vertex_corner[chain.back()]});
    }
}

FeatureLimits feature_limits(const BoundaryOptions& options) {
    return {options.feature_angle_deg, options.corner_turn_deg, options.patch_borders};
}

} // namespace hexopt
