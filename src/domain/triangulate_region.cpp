#include "domain/triangulate_region.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <utility>

namespace hexopt {

namespace {

Error failure(const std::string& reason) { return make_error(ErrorCode::bad_input, "outline", "", reason); }

using FlatKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Index, FlatKernel>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<int, FlatKernel,
                                              CGAL::Constrained_triangulation_face_base_2<FlatKernel>>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<FlatKernel,
                                               CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;

/// Numbers faces by how many loops lie between them and the outside: odd is inside.
void count_nesting(Delaunay& delaunay) {
    constexpr int kUnknown = -1;
    for (auto f : delaunay.all_face_handles()) f->info() = kUnknown;
    std::vector<Delaunay::Face_handle> here = {delaunay.infinite_face()}, beyond;
    for (int depth = 0; !here.empty(); ++depth) {
        while (!here.empty()) {
            const auto face = here.back();
            here.pop_back();
            if (face->info() != kUnknown) continue;
            face->info() = depth;
            for (int k = 0; k < 3; ++k)
                if (face->neighbor(k)->info() == kUnknown)
                    (face->is_constrained(k) ? beyond : here).push_back(face->neighbor(k));
        }
        std::swap(here, beyond);
    }
}

} // namespace

Result<std::vector<std::array<Index, 3>>> triangulate_region(const std::vector<std::vector<Point2>>& loops) {
    Delaunay delaunay;
    Index number = 0;
    const auto insert = [&](const std::vector<Point2>& loop) {
        std::vector<Delaunay::Vertex_handle> vertices;
        for (const Point2& p : loop) {
            vertices.push_back(delaunay.insert({p.x, p.y}));
            vertices.back()->info() = number++;
        }
        for (std::size_t i = 0; i < vertices.size(); ++i)
            delaunay.insert_constraint(vertices[i], vertices[(i + 1) % vertices.size()]);
    };
    try {
        for (const auto& loop : loops) insert(loop);
    } catch (const Delaunay::Intersection_of_constraints_exception&) {
        return failure("the outline crosses itself");
    }
    if (delaunay.number_of_vertices() != number) return failure("the outline passes twice through a point");
    count_nesting(delaunay);
    std::vector<std::array<Index, 3>> triangles;
    for (auto f : delaunay.finite_face_handles())
        if (f->info() % 2 == 1)
            triangles.push_back({f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()});
    return triangles;
}

} // namespace hexopt
