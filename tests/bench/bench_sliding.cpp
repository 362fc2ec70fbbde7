// What a sliding boundary costs. Usage:
//   bench_sliding MESH [deviation]            a mesh on its own boundary
//   bench_sliding SIZE LEVELS [deviation]     octree cells inside a ball, their staircase projected onto it
//   and a
//                                             nearly flat layer of cells inserted there, as a mesher does
// deviation: as --max-deviation-rel, default 0. Prints what the optimizer logs with the CPU seconds so far.
#include "domain/boundary_model.hpp"
#include "io/mesh_io.hpp"
#include "mesh/topology.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/optimize.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <glm/geometric.hpp>
#include <map>

using namespace hexopt;

namespace {

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// A sphere as an octahedron cut `cuts` times.
TriangleSoup make_sphere(const Point& centre, double radius, int cuts) {
    TriangleSoup soup;
    soup.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    soup.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int cut = 0; cut < cuts; ++cut) {
        std::map<std::pair<Index, Index>, Index> middle;
        const auto between = [&](Index a, Index b) {
            const auto [at, is_new] = middle.try_emplace(std::minmax(a, b), Index(soup.vertices.size()));
            if (is_new) soup.vertices.push_back(glm::normalize(soup.vertices[a] + soup.vertices[b]));
            return at->second;
        };
        std::vector<std::array<Index, 3>> finer;
        for (const auto& [a, b, c] : soup.triangles) {
            const Index ab = between(a, b), bc = between(b, c), ca = between(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        soup.triangles = std::move(finer);
    }
    for (Point& p : soup.vertices) p = centre + radius * p;
    return soup;
}

/// Projects the boundary onto the sphere and puts a layer of cells there, `thickness` thick.
void insert_layer(HexMesh& mesh, const Point& centre, double radius, double thickness) {
    const Topology topology = compute_topology(mesh);
    std::map<Index, Index> outer;
    for (CellFace face : topology.boundary_faces) {
        const Quad quad = face_vertices(mesh, face);
        Cell cell;
        for (std::size_t k = 0; k < 4; ++k) {
            const auto [at, is_new] = outer.try_emplace(quad[k], Index(mesh.positions.size()));
            if (is_new) {
                const Point out = glm::normalize(mesh.positions[quad[k]] - centre);
                mesh.positions.push_back(centre + radius * out);
                mesh.positions[quad[k]] = centre + (radius - thickness) * out;
            }
            cell[k] = quad[k];
            cell[k + 4] = at->second;
        }
        const std::uint8_t level = mesh.level[face.cell];
        mesh.cells.push_back(cell);
        mesh.level.push_back(level);
    }
    ++mesh.revision;
}

Result<HexMesh> make_ball(Index size, int levels, Context& context, TriangleSoup& sphere) {
    SampleOptions options;
    options.size = size;
    options.levels = levels;
    Result<HexMesh> mesh = make_sample("octree-trimmed", options, context);
    if (!mesh) return mesh;
    Point low = mesh->positions[0], high = low;
    for (const Point& p : mesh->positions) low = glm::min(low, p), high = glm::max(high, p);
    const Point centre = 0.5 * (low + high);
    const double cell = std::ldexp(1.0 / size, -levels), radius = 0.47;
    sphere = make_sphere(centre, radius, 7);
    insert_layer(*mesh, centre, radius, 0.05 * cell);
    return mesh;
}

int fail(const Error& error) {
    std::fprintf(stderr, "%s\n", error.one_line().c_str());
    return 1;
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    const bool generated = std::atoi(argv[1]) > 0;
    Context context(1);
    TriangleSoup sphere;
    Result<HexMesh> mesh = generated ? make_ball(static_cast<Index>(std::atoi(argv[1])),
                                                 argc > 2 ? std::atoi(argv[2]) : 2, context, sphere)
                                     : read_mesh(argv[1], context);
    if (!mesh) return fail(mesh.error());
    OptimizeOptions options;
    const int rest = generated ? 3 : 2;
    if (generated) options.effort = Effort::quick;
    options.max_deviation_rel = argc > rest ? std::atof(argv[rest]) : 0;
    const Topology topology = compute_topology(*mesh);
    const auto surface = generated ? build_boundary_model(*mesh, topology, sphere, {}, context)
                                   : build_boundary_model(*mesh, topology, {}, context);
    if (!surface) return fail(surface.error());
    const double start = cpu_seconds();
    context.set_log_sink([&](LogLevel, std::string_view text) {
        std::printf("%8.2f  %.*s\n", cpu_seconds() - start, static_cast<int>(text.size()), text.data());
    });
    const auto stats = optimize(*mesh, topology, &*surface, options, context);
    if (!stats) return fail(stats.error());
    const double seconds = cpu_seconds() - start;
    std::printf("%zu cells, %zu boundary quads, concave %zu/%zu -> %zu/%zu, min SJ %.3f -> %.3f, %.2f CPU s, "
                "%.1f us a "
                "cell, %d Newton steps, %d cg\n",
                mesh->cell_count(), topology.boundary_faces.size(), stats->bad8_before, stats->bad32_before,
                stats->bad8_after, stats->bad32_after, stats->min_sj_before, stats->min_sj_after, seconds,
                1e6 * seconds / static_cast<double>(mesh->cell_count()), stats->newton_steps,
                stats->cg_iterations);
}
