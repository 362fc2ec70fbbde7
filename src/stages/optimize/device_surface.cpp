#include "stages/optimize/device_surface.hpp"

#include <algorithm>

namespace hexopt {

using compute::Buffer;
using compute::Precision;

namespace {

// Elements and trees as the kernels have them, in the frame of the device.
class SurfaceArrays {
  public:
    SurfaceArrays(const DeviceFrame& frame, Precision precision) : frame_(frame), precision_(precision) {}

    void add_element(const std::array<Point, 3>& corner, const std::array<Point, 3>& direction) {
        for (const Point& p : corner) element_.push_back(rounded(frame_.to_local(p)));
        element_.insert(element_.end(), direction.begin(), direction.end());
    }

    // The model keeps the elements of an entity in the order of a tree's leaves: halves are near one another.
    std::array<std::uint32_t, 2> add_tree(std::uint32_t first, std::uint32_t last) {
        const auto begin = static_cast<std::uint32_t>(link_.size() / 2);
        if (first < last) add_node(first, last);
        return {begin, static_cast<std::uint32_t>(link_.size() / 2)};
    }

    const std::vector<Point>& boxes() const { return box_; }
    const std::vector<std::uint32_t>& links() const { return link_; }
    const std::vector<Point>& elements() const { return element_; }

  private:
    // As the device will hold it, so that boxes contain what they are meant to.
    Point rounded(Point p) const {
        for (int axis = 0; precision_ == Precision::f32 && axis < 3; ++axis)
            p[axis] = static_cast<double>(static_cast<float>(p[axis]));
        return p;
    }

    Box add_node(std::uint32_t first, std::uint32_t last) {
        const std::size_t node = link_.size() / 2;
        link_.insert(link_.end(), {0, 0});
        box_.insert(box_.end(), 2, Point(0));
        Box box;
        if (last - first == 1) {
            for (std::size_t k = 0; k < 3; ++k) box.add(element_[6 * std::size_t{first} + k]);
            link_[2 * node + 1] = first + 1;
        } else {
            const std::uint32_t middle = first + (last - first) / 2;
            box.add(add_node(first, middle));
            box.add(add_node(middle, last));
        }
        link_[2 * node] = static_cast<std::uint32_t>(link_.size() / 2);
        box_[2 * node] = box.low;
        box_[2 * node + 1] = box.high;
        return box;
    }

    const DeviceFrame& frame_;
    Precision precision_;
    std::vector<Point> element_, box_;
    std::vector<std::uint32_t> link_;
};

void add_curves(const BoundaryModel& model, SurfaceArrays& arrays, DeviceSurface& surface) {
    for (Index s = 0; s < model.segment_count(); ++s) {
        const auto& [a, b] = model.segment(s);
        const auto& [at_a, at_b] = model.vertex_tangents(s);
        arrays.add_element({a, b, b}, {at_a, at_b, at_b});
    }
    const auto count = static_cast<Index>(model.segment_count());
    Index first = 0;
    for (Index curve = 0; curve < model.curve_count(); ++curve) {
        Index last = first;
        while (last < count && model.curve_of_segment(last) == curve) ++last;
        surface.curve_nodes.push_back(
            arrays.add_tree(surface.first_segment + first, surface.first_segment + last));
        first = last;
    }
}

} // namespace

Result<DeviceSurface> DeviceSurface::create(compute::Backend& backend, Precision precision,
                                            const DeviceFrame& frame, const BoundaryModel& model) {
    DeviceSurface surface;
    SurfaceArrays arrays(frame, precision);
    for (Index t = 0; t < model.triangle_count(); ++t)
        arrays.add_element(model.triangle(t), model.vertex_normals(t));
    for (Index patch = 0; patch < model.patch_count(); ++patch) {
        const auto [first, last] = model.patch_triangles(patch);
        surface.patch_nodes.push_back(arrays.add_tree(first, last));
    }
    surface.first_segment = static_cast<std::uint32_t>(model.triangle_count());
    add_curves(model, arrays, surface);
    surface.first_corner = surface.first_segment + static_cast<std::uint32_t>(model.segment_count());
    surface.first_corner_node = static_cast<std::uint32_t>(arrays.links().size() / 2);
    for (Index c = 0; c < model.corner_count(); ++c) {
        const Point p = model.corner_point(c);
        arrays.add_element({p, p, p}, {Point(0), Point(0), Point(0)});
        (void)arrays.add_tree(surface.first_corner + c, surface.first_corner + c + 1);
    }
    const auto take = [](Buffer& to, Result<Buffer> made) -> Status {
        if (!made) return made.error();
        to = std::move(*made);
        return Done{};
    };
    Status status = take(surface.box, upload_points(backend, precision, arrays.boxes(), "surface boxes"));
    if (status)
        status =
            take(surface.link, compute::create_array<std::uint32_t>(backend, arrays.links(), "surface tree"));
    if (status)
        status =
            take(surface.element, upload_points(backend, precision, arrays.elements(), "surface elements"));
    if (!status) return status.error();
    return surface;
}

std::array<std::uint32_t, 2> DeviceSurface::nodes(Association bound_to) const {
    if (bound_to.kind == EntityKind::patch) return patch_nodes[bound_to.entity];
    if (bound_to.kind == EntityKind::curve) return curve_nodes[bound_to.entity];
    return {first_corner_node + bound_to.entity, first_corner_node + bound_to.entity + 1};
}

std::uint32_t DeviceSurface::element_of(Association bound_to, Index number) const {
    if (bound_to.kind == EntityKind::patch) return number;
    if (bound_to.kind == EntityKind::curve) return first_segment + number;
    return first_corner + bound_to.entity;
}

} // namespace hexopt
