/// Refines and trims a surface: bench_trim SURFACE [target cells [out.vtu [strict|remove|plain]...]]
/// Prints counts and processor times of one thread, writes the last trimmed mesh. plain: without orienting
/// the surface first.
#include "bench/bench_support.hpp"
#include "domain/orient_surface.hpp"
#include "io/mesh_io.hpp"
#include "io/read_surface.hpp"
#include "stages/refine/refine.hpp"
#include "stages/trim/trim.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

using namespace hexopt;
using namespace hexopt::bench;

namespace {

void print(const OrientedSurface& surface, double seconds) {
    const OrientationReport& r = surface.report;
    std::printf(
        "%zu triangles, %.3f s: flipped %zu, repeated %zu, sheets %zu, pieces %zu, bodies %zu, cavities %zu, "
        "open pieces %zu, unorientable %zu\n",
        surface.soup.triangles.size(), seconds, r.flipped_triangles, r.repeated_triangles, r.sheet_triangles,
        r.pieces, r.bodies, r.cavities, r.open_pieces, r.unorientable_edges);
}

void print(const TrimOutput& out, double seconds) {
    const TrimReport& r = out.report;
    std::printf("%zu to refine, %zu -> %zu cells, %.3f s (%.2f us/cell): cut %zu, uncertain %zu | ",
                out.refine_cells.size(), r.octree_cells, r.kept_cells, seconds,
                1e6 * seconds / static_cast<double>(r.octree_cells), r.cut_cells, r.uncertain_cells);
    std::printf("volume %.4g of %.4g, bare %.2f %% at %zu places | ", r.kept_volume, r.enclosed_volume,
                100 * r.bare_area / r.surface_area, out.bare_spots.size());
    std::printf("gap %zu, manifold %zu, tips %zu, pits %zu, filled %zu, partial %zu | ", r.gap_removed,
                r.manifold_removed, r.tips_removed, r.pits_filled, r.partial_filled, r.partial_removed);
    std::printf(
        "parts %zu, dropped %zu (%zu cells) | half faces %zu, edges %zu | open %zu, nonmanifold %zu + %zu\n",
        r.parts, r.parts_dropped, r.part_cells_dropped, r.half_faces, r.half_edges, r.open_edges,
        r.nonmanifold_edges, r.nonmanifold_vertices);
}

constexpr int kRounds = 10;

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    RefineOptions refine_options;
    refine_options.target_cells = argc > 2 ? std::atof(argv[2]) : 50e3;
    TrimOptions options;
    bool orient = true;
    for (int i = 4; i < argc; ++i) {
        if (!std::strcmp(argv[i], "strict")) options.rule = TrimRule::strict;
        if (!std::strcmp(argv[i], "remove")) options.partial = PartialFaces::remove;
        if (!std::strcmp(argv[i], "plain")) orient = false;
    }
    Context context(1);
    TriangleSoup soup = must(read_surface(argv[1], context));
    auto start = std::clock();
    if (orient) {
        OrientedSurface surface = must(orient_surface(soup, context));
        print(surface, seconds_since(start));
        soup = std::move(surface.soup);
    }
    const Domain domain = must(build_domain(soup, {}, context));
    start = std::clock();
    RefineOutput refined = must(refine(domain, refine_options, context));
    std::printf("refined in %.3f s\n", seconds_since(start));
    for (int round = 0;; ++round) {
        if (round == kRounds) options.partial = PartialFaces::remove; // as a pipeline at its limit
        start = std::clock();
        const TrimOutput out = must(trim(refined.octree, domain, options, context));
        const bool last = out.refine_cells.empty() || round == kRounds;
        if (round == 0 || last) std::printf("round %d: ", round), print(out, seconds_since(start));
        if (!last) {
            refine_cells(refined, out.refine_cells, context);
            continue;
        }
        if (argc > 3) must(write_mesh(argv[3], out.kept, {}, {}, context));
        return out.refine_cells.empty() && out.report.closed_manifold() ? 0 : 1;
    }
}
