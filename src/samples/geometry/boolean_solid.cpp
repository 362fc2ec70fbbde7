#include "samples/geometry/solid.hpp"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <map>
#include <numeric>

namespace hexopt::geometry {

namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<ExactKernel::Point_3>;
using Face = Mesh::Face_index;
using PatchMap = Mesh::Property_map<Face, Index>;

Error failure(const std::string& reason) { return make_error(ErrorCode::bad_input, "sample", "", reason); }

PatchMap patches_of(Mesh& mesh) { return mesh.add_property_map<Face, Index>("f:patch", kNoIndex).first; }

/// Hands the patch of a triangle on to its pieces and copies.
struct PatchVisitor : pmp::Corefinement::Default_visitor<Mesh> {
    void before_subface_creations(Face whole, Mesh& mesh) { current = patches_of(mesh)[whole]; }
    void after_subface_created(Face piece, Mesh& mesh) { patches_of(mesh)[piece] = current; }
    void after_face_copy(Face from, const Mesh& source, Face to, Mesh& target) {
        patches_of(target)[to] = source.property_map<Face, Index>("f:patch").first[from];
    }
    Index current = kNoIndex;
};

/// Makes one of the ends of edges that rounding has left without length, or with next to none.
void close_short_edges(Solid& solid) {
    Point low = solid.vertices.front(), high = low;
    for (const Point& p : solid.vertices) low = glm::min(low, p), high = glm::max(high, p);
    const double shortest = 1e-9 * glm::distance(low, high);
    std::vector<Index> same(solid.vertices.size());
    std::iota(same.begin(), same.end(), Index{0});
    const auto root = [&same](Index v) {
        while (same[v] != v) v = same[v];
        return v;
    };
    for (const auto& t : solid.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = root(t[k]), b = root(t[(k + 1) % 3]);
            if (glm::distance(solid.vertices[t[k]], solid.vertices[t[(k + 1) % 3]]) <= shortest)
                same[std::max(a, b)] = std::min(a, b);
        }
    Solid kept;
    kept.patch_names = std::move(solid.patch_names);
    std::vector<Index> number(same.size(), kNoIndex);
    for (std::size_t t = 0; t < solid.triangles.size(); ++t) {
        std::array<Index, 3> corner;
        for (std::size_t k = 0; k < 3; ++k) corner[k] = root(solid.triangles[t][k]);
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
        for (Index& v : corner) {
            if (number[v] == kNoIndex) {
                number[v] = static_cast<Index>(kept.vertices.size());
                kept.vertices.push_back(solid.vertices[v]);
            }
            v = number[v];
        }
        kept.triangles.push_back(corner);
        kept.patch.push_back(solid.patch[t]);
    }
    solid = std::move(kept);
}

} // namespace

struct BooleanSolid::Exact {
    Mesh mesh;
    std::vector<std::string> names;
    bool is_sound = true;

    Index number_of(const std::string& name) {
        const auto number = std::find(names.begin(), names.end(), name) - names.begin();
        if (number == std::ssize(names)) names.push_back(name);
        return static_cast<Index>(number);
    }
    Mesh convert(const Solid& solid) {
        Mesh out;
        PatchMap patch = patches_of(out);
        for (const Point& p : solid.vertices) out.add_vertex({p.x, p.y, p.z});
        for (std::size_t t = 0; t < solid.triangles.size(); ++t) {
            const auto& [a, b, c] = solid.triangles[t];
            const Face face =
                out.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c));
            if (face == Mesh::null_face())
                is_sound = false;
            else
                patch[face] = number_of(solid.patch_names[solid.patch[t]]);
        }
        return out;
    }
    template <class Operation>
    void apply(const Solid& other, const Operation& operation) {
        Mesh second = convert(other);
        if (is_sound) is_sound = operation(mesh, second, CGAL::parameters::visitor(PatchVisitor{}));
    }
};

BooleanSolid::BooleanSolid(const Solid& first) : exact_(std::make_unique<Exact>()) {
    exact_->mesh = exact_->convert(first);
}
BooleanSolid::~BooleanSolid() = default;
BooleanSolid::BooleanSolid(BooleanSolid&&) noexcept = default;

BooleanSolid& BooleanSolid::unite(const Solid& other) {
    exact_->apply(other, [](Mesh& a, Mesh& b, const auto& parameters) {
        return pmp::corefine_and_compute_union(a, b, a, parameters);
    });
    return *this;
}

BooleanSolid& BooleanSolid::subtract(const Solid& other) {
    exact_->apply(other, [](Mesh& a, Mesh& b, const auto& parameters) {
        return pmp::corefine_and_compute_difference(a, b, a, parameters);
    });
    return *this;
}

BooleanSolid& BooleanSolid::intersect(const Solid& other) {
    exact_->apply(other, [](Mesh& a, Mesh& b, const auto& parameters) {
        return pmp::corefine_and_compute_intersection(a, b, a, parameters);
    });
    return *this;
}

Result<Solid> BooleanSolid::finish() {
    if (!exact_->is_sound) return failure("two of its parts touch where the result would not be a manifold");
    const Mesh& mesh = exact_->mesh;
    const PatchMap patch = mesh.property_map<Face, Index>("f:patch").first;
    Solid out;
    if (mesh.number_of_faces() == 0) return failure("nothing is left of it");
    std::vector<Index> kept(exact_->names.size(), kNoIndex);
    for (Face face : mesh.faces()) kept[patch[face]] = 0;
    for (std::size_t p = 0; p < kept.size(); ++p)
        if (kept[p] != kNoIndex) {
            kept[p] = static_cast<Index>(out.patch_names.size());
            out.patch_names.push_back(exact_->names[p]);
        }
    std::map<Mesh::Vertex_index, Index> number;
    const auto vertex = [&](Mesh::Vertex_index v) {
        const auto [entry, is_new] = number.try_emplace(v, static_cast<Index>(out.vertices.size()));
        if (is_new) {
            const auto& p = CGAL::exact(mesh.point(v));
            out.vertices.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z()));
        }
        return entry->second;
    };
    for (Face face : mesh.faces()) {
        std::array<Index, 3> triangle;
        std::size_t i = 0;
        for (auto v : mesh.vertices_around_face(mesh.halfedge(face))) triangle[i++] = vertex(v);
        out.triangles.push_back(triangle);
        out.patch.push_back(kept[patch[face]]);
    }
    close_short_edges(out);
    return out;
}

} // namespace hexopt::geometry
