/// Trims an octree round a surface: bench_trim SURFACE [roots [levels [out.vtu [strict|remove]]]]
/// Prints counts and times, writes the last trimmed mesh.
#include "domain/orient_surface.hpp"
#include "io/mesh_io.hpp"
#include "io/read_surface.hpp"
#include "stages/trim/trim.hpp"
#include "trim/surface_octree.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <class T>
T must(Result<T> result) {
    if (result) return std::move(result).value();
    std::fprintf(stderr, "%s\n", result.error().one_line().c_str());
    std::exit(1);
}

void print(const TrimOutput& out, double seconds) {
    const TrimReport& r = out.report;
    std::printf(
        "%zu -> %zu cells, %.3f s (%.2f us/cell), cut %zu, uncertain %zu | gap %zu manifold %zu tips %zu "
        "pits %zu filled %zu partial %zu | parts %zu dropped %zu (%zu cells) | half faces %zu edges %zu | "
        "open %zu "
        "nonmanifold %zu + %zu\n",
        r.octree_cells, r.kept_cells, seconds, 1e6 * seconds / static_cast<double>(r.octree_cells),
        r.cut_cells, r.uncertain_cells, r.gap_removed, r.manifold_removed, r.tips_removed, r.pits_filled,
        r.partial_filled, r.partial_removed, r.parts, r.parts_dropped, r.part_cells_dropped, r.half_faces,
        r.half_edges, r.open_edges, r.nonmanifold_edges, r.nonmanifold_vertices);
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    const auto roots = static_cast<std::uint32_t>(argc > 2 ? std::atoi(argv[2]) : 16);
    const int levels = argc > 3 ? std::atoi(argv[3]) : 3;
    TrimOptions options;
    for (int i = 5; i < argc; ++i) {
        if (!std::strcmp(argv[i], "strict")) options.rule = TrimRule::strict;
        if (!std::strcmp(argv[i], "remove")) options.partial = PartialFaces::remove;
    }
    Context context(2);
    auto start = std::chrono::steady_clock::now();
    const OrientedSurface surface = must(orient_surface(must(read_surface(argv[1], context)), context));
    const OrientationReport& r = surface.report;
    std::printf(
        "%zu triangles: flipped %zu, repeated %zu, sheets %zu, pieces %zu, bodies %zu, cavities %zu, open "
        "pieces %zu, unorientable %zu; %.3f s\n",
        surface.soup.triangles.size(), r.flipped_triangles, r.repeated_triangles, r.sheet_triangles, r.pieces,
        r.bodies, r.cavities, r.open_pieces, r.unorientable_edges, seconds_since(start));
    const Domain domain = must(build_domain(surface.soup, {}, context));
    SurfaceOctree octree = octree_round(surface_box(domain.model), roots);
    const BoundaryModel& model = domain.model;
    // The last level only round curves, so that level fronts cross the surface.
    const auto near = [&](const Point& p, double edge, int level) {
        const double reach = 0.87 * edge;
        if (level + 1 < levels || model.curve_count() == 0) return model.distance(p) < reach + 0.5 * edge;
        return model.project_curve(kNoIndex, p).distance < reach + 0.5 * edge;
    };
    int deepest = levels;
    for (int round = 0;; ++round) {
        const HexMesh mesh = octree.make(deepest, near);
        start = std::chrono::steady_clock::now();
        const TrimOutput out = must(trim(mesh, domain, options, context));
        const bool last = out.refine_cells.empty() || round == 12;
        if (round == 11) options.partial = PartialFaces::remove; // as a pipeline at its level limit
        if (round == 0 || last) {
            std::printf("round %d, %zu to refine: ", round, out.refine_cells.size());
            print(out, seconds_since(start));
        }
        for (Index c : out.refine_cells) deepest = std::max(deepest, mesh.level[c] + 1);
        octree.ask(mesh, out.refine_cells);
        if (!last) continue;
        if (argc > 4) must(write_mesh(argv[4], out.kept, {}, {}, context));
        return out.refine_cells.empty() && out.report.closed_manifold() ? 0 : 1;
    }
}
