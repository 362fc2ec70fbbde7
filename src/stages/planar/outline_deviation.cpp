#include "stages/planar/outline_deviation.hpp"

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

constexpr int kPlaces = 15; ///< inside an edge

struct Sum {
    DirectedDeviation of;
    double squares = 0;
    std::size_t count = 0;

    void add(double distance, const Point2& at, Index element) {
        squares += distance * distance;
        ++count;
        of.upper = std::max(of.upper, distance);
        if (distance <= of.largest) return;
        of.largest = distance;
        of.at = Point(at, 0);
        of.element = element;
    }
    void add(const Sum& other) {
        squares += other.squares;
        count += other.count;
        const double upper = std::max(of.upper, other.of.upper);
        if (other.of.largest > of.largest) of = other.of;
        of.upper = upper;
    }
    DirectedDeviation finish() const {
        DirectedDeviation made = of;
        made.rms = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
        return made;
    }
};

SegmentTree tree_of_wall(const QuadMesh& mesh) {
    std::vector<SegmentTree::Segment> edges;
    for (const QuadMesh::WallEdge& edge : mesh.wall)
        edges.push_back({mesh.positions[edge.a], mesh.positions[edge.b]});
    return SegmentTree(std::move(edges));
}

template <class Visit>
DirectedDeviation sum_over(std::size_t count, const Parallel& parallel, const Visit& visit) {
    return parallel
        .reduce<Sum>(
            count, 256, {},
            [&](std::size_t begin, std::size_t end) {
                Sum part;
                for (std::size_t i = begin; i < end; ++i) visit(static_cast<Index>(i), part);
                return part;
            },
            [](Sum a, const Sum& b) {
                a.add(b);
                return a;
            })
        .finish();
}

} // namespace

std::vector<Index> find_wall_contacts(const QuadMesh& mesh) {
    const auto side_of = [](const Point2& a, const Point2& b, const Point2& p) {
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    };
    const SegmentTree wall = tree_of_wall(mesh);
    std::vector<Index> found;
    for (Index e = 0; e < wall.size(); ++e) {
        const auto& [a, b] = wall.segment(e);
        Box2 box;
        box.add(a);
        box.add(b);
        const QuadMesh::WallEdge& own = mesh.wall[e];
        bool touched = false;
        wall.visit_box(box, [&](Index other) {
            const auto& [c, d] = wall.segment(other);
            const QuadMesh::WallEdge& edge = mesh.wall[other];
            if (edge.a == own.a || edge.a == own.b || edge.b == own.a) return true;
            touched = side_of(a, b, c) * side_of(a, b, d) <= 0 && side_of(c, d, a) * side_of(c, d, b) <= 0;
            return !touched;
        });
        if (touched) found.push_back(e);
    }
    return found;
}

Deviation measure_outline_deviation(const QuadMesh& mesh, const OutlineCurves& curves,
                                    const Parallel& parallel) {
    const SegmentTree wall = tree_of_wall(mesh);
    Deviation found;
    found.diagonal = curves.diagonal();
    found.surface_to_mesh = sum_over(curves.tree().size(), parallel, [&](Index s, Sum& sum) {
        const Point2 p = curves.tree().segment(s)[0];
        sum.add(wall.nearest(p).distance, p, s);
    });
    found.mesh_to_surface = sum_over(wall.size(), parallel, [&](Index e, Sum& sum) {
        const auto& [a, b] = wall.segment(e);
        for (int k = 1; k <= kPlaces; ++k) {
            const Point2 p = a + (k / (kPlaces + 1.0)) * (b - a);
            sum.add(curves.tree().nearest(p).distance, p, e);
        }
        const QuadMesh::Place& from = mesh.place[mesh.wall[e].a];
        const double length = curves.length(from.loop), gap = mesh.place[mesh.wall[e].b].s - from.s;
        const double to = from.s + gap - std::floor(gap / length) * length;
        sum.of.upper = std::max(sum.of.upper, curves.chord_deviation(from.loop, from.s, to));
    });
    found.mesh_to_curves = found.mesh_to_surface;
    found.curves_to_mesh = found.surface_to_mesh;
    return found;
}

} // namespace hexopt
