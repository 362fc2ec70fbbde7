// Closest points against CGAL's AABB tree, which shares nothing with the library's own tree.
#include "domain/boundary_model.hpp"
#include "domain/sample_meshes.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Point& p) { return {p.x, p.y, p.z}; }

void compare(const HexMesh& mesh, const Point& centre, double size, unsigned seed) {
    Context context(1);
    const Result<BoundaryModel> model = build_boundary_model(mesh, compute_topology(mesh), {}, context);
    REQUIRE(model);
    Triangles triangles;
    for (Index t = 0; t < model->triangle_count(); ++t) {
        const auto& x = model->triangle(t);
        triangles.emplace_back(to_cgal(x[0]), to_cgal(x[1]), to_cgal(x[2]));
    }
    const Tree tree(triangles.begin(), triangles.end());
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    double worst = 0;
    for (int i = 0; i < 5000; ++i) {
        const double reach = size * std::pow(10.0, -3 + i % 5);
        const Point q = mesh.positions[random() % mesh.vertex_count()] +
                        reach * Point(normal(random), normal(random), normal(random));
        const double expected = std::sqrt(CGAL::to_double(tree.squared_distance(to_cgal(q))));
        const Projection found = model->project_patch(kNoIndex, q, static_cast<Index>(random()));
        worst = std::max(worst, std::abs(found.distance - expected) / (size + glm::length(q - centre)));
    }
    CHECK(worst < 1e-13);
}

} // namespace

TEST_CASE("closest points agree with CGAL's") {
    compare(test::ball(10), Point(0), 2, 1);
    compare(test::cylinder(7), Point(0), 2, 2);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-0.2, 0.2);
    const Point far(1e4, -2e4, 1e3);
    const auto rough = [&](const Point& p) {
        return far + p + Point(uniform(random), uniform(random), uniform(random));
    };
    compare(test::grid(4, 5, 6, rough), far, 1e2, 3);
}
