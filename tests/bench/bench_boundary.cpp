/// Projections per second onto the boundary of a ball: bench_boundary [cells per side]
#include "domain/boundary_model.hpp"
#include "domain/sample_meshes.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// offset: largest component of the random displacement of a query from its vertex, model units.
void time_projections(const HexMesh& mesh, const BoundaryModel& model, double offset, bool warm) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-offset, offset);
    std::vector<Association> bound_to;
    std::vector<Point> query;
    std::vector<Index> hint;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Association a = model.associations()[v];
        if (a.kind != EntityKind::patch && a.kind != EntityKind::curve) continue;
        bound_to.push_back(a);
        hint.push_back(warm ? model.project(a, mesh.positions[v]).element : kNoIndex);
        query.push_back(mesh.positions[v] + Point(uniform(random), uniform(random), uniform(random)));
    }
    std::size_t count = 0;
    double sum = 0;
    const auto start = std::chrono::steady_clock::now();
    while (seconds_since(start) < 1) {
        for (std::size_t i = 0; i < query.size(); ++i)
            sum += model.project(bound_to[i], query[i], hint[i]).distance;
        count += query.size();
    }
    std::printf("  offset %.4f, %s: %.0f ns a projection (mean distance %.3g)\n", offset,
                warm ? "warm" : "cold", 1e9 * seconds_since(start) / static_cast<double>(count),
                sum / static_cast<double>(count));
}

void run(const char* name, const HexMesh& mesh, int n) {
    Context context(1);
    const Topology topology = compute_topology(mesh);
    const auto start = std::chrono::steady_clock::now();
    const Result<BoundaryModel> model = build_boundary_model(mesh, topology, {}, context);
    if (!model) {
        std::fprintf(stderr, "%s\n", model.error().one_line().c_str());
        std::exit(1);
    }
    std::printf("%s, %zu quads, %zu triangles, built in %.3f s\n", name, topology.boundary_faces.size(),
                model->triangle_count(), seconds_since(start));
    for (double offset : {0.0, 0.1 / n, 0.5 / n})
        for (bool warm : {false, true}) time_projections(mesh, *model, offset, warm);
}

} // namespace

int main(int argc, char** argv) {
    const int n = argc > 1 ? std::atoi(argv[1]) : 64;
    if (n < 2) {
        std::fprintf(stderr, "usage: bench_boundary [cells per side, at least 2]\n");
        return 2;
    }
    run("ball", test::ball(n), n);
    run("cylinder", test::cylinder(n), n);
    return 0;
}
