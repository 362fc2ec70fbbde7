#include "stages/trim/trim.hpp"

#include "stages/trim/coverage.hpp"
#include "stages/trim/emit_kept.hpp"
#include "stages/trim/partial_faces.hpp"
#include "stages/trim/seeds.hpp"
#include "stages/trim/surface_check.hpp"
#include "stages/trim/thin_walls.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <numeric>
#include <span>

namespace hexopt {

namespace {

using trimming::CellGraph;
using trimming::CellSides;
using trimming::KeptCells;

Error trim_error(ErrorCode code, std::string where, std::string reason) {
    return make_error(code, "trim", std::move(where), std::move(reason));
}

std::string place(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

Status check_options(const TrimOptions& options) {
    if (!(options.depth_h >= 0 && options.depth_h <= 0.5))
        return trim_error(ErrorCode::usage, "", "depth_h must be in 0..0.5");
    if (!(options.thinnest_wall_h >= 0 && options.thinnest_wall_h <= 1))
        return trim_error(ErrorCode::usage, "", "thinnest_wall_h must be in 0..1");
    if (!(options.part_fraction >= 0 && options.part_fraction <= 1))
        return trim_error(ErrorCode::usage, "", "part_fraction must be in 0..1");
    return Done{};
}

/// For each seed the kept cell that holds it, or the nearest one if that is not far.
Result<std::vector<Index>> find_kept_seeds(const HexMesh& mesh, const KeptCells& kept,
                                           std::span<const Point> seeds, std::vector<Index> cells) {
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        if (kept.is_kept(cells[i])) continue;
        double nearest = 3 * trimming::cell_size(mesh, cells[i]);
        for (Index c = 0; c < mesh.cell_count(); ++c) {
            if (!kept.is_kept(c)) continue;
            const double distance = glm::length(trimming::cell_centre(mesh, c) - seeds[i]);
            if (distance < nearest) nearest = distance, cells[i] = c;
        }
        if (!kept.is_kept(cells[i]))
            return trim_error(ErrorCode::bad_input, "seed " + place(seeds[i]),
                              "no cell is kept there: it is outside, or in a part too thin for the cells");
    }
    return cells;
}

double enclosed_volume(const BoundaryModel& model) {
    double volume = 0;
    const Point origin = model.triangle(0)[0];
    for (Index t = 0; t < model.triangle_count(); ++t) {
        const auto& x = model.triangle(t);
        volume += glm::dot(x[0] - origin, glm::cross(x[1] - origin, x[2] - origin)) / 6;
    }
    return volume;
}

/// Mends and drops parts until neither changes anything, removing partial sides where asked to.
Status mend_all(const HexMesh& octree, const CellGraph& graph, const CellSides& sides,
                const TrimOptions& options, const std::vector<Index>& seed_cells, KeptCells& kept,
                TrimReport& report) {
    for (;;) {
        kept.mend();
        const auto kept_seeds = find_kept_seeds(octree, kept, options.seeds, seed_cells);
        if (!kept_seeds) return kept_seeds.error();
        kept.keep_parts(*kept_seeds, options.part_fraction);
        const trimming::PartialSides partial = trimming::find_partial_sides(octree, graph, kept);
        const std::size_t filled = trimming::fill_partial(graph, sides, kept, partial);
        const std::size_t removed = filled == 0 && options.partial == PartialFaces::remove
                                        ? trimming::remove_partial(octree, graph, kept, partial)
                                        : 0;
        if (filled + removed == 0) return Done{};
        report.partial_filled += filled;
        report.partial_removed += removed;
    }
}

/// Error where the cells that the seeds flood reach the outside; *path gets them.
Status check_leaks(const HexMesh& octree, const CellGraph& graph, const CellSides& sides,
                   const TrimOptions& options, const std::vector<Index>& seed_cells, bool seeds_inside,
                   const KeptCells& kept, std::vector<Index>* path) {
    // Holes do not let the centre rule through; strictly, whatever the surface does not cut is flooded.
    std::vector<std::uint8_t> open(kept.kept().begin(), kept.kept().end()), outside(open.size(), 1);
    if (options.rule == TrimRule::strict)
        for (Index c = 0; c < open.size(); ++c) open[c] = !sides.cut[c];
    if (seeds_inside)
        for (Index c = 0; c < open.size(); ++c) outside[c] = !sides.inside[c];
    for (std::size_t i = 0; i < seed_cells.size(); ++i) {
        if (!open[seed_cells[i]]) continue;
        std::vector<Index> found = trimming::find_path_outside(graph, seed_cells[i], open, outside);
        if (found.empty()) continue;
        const auto hole = std::find_if(found.begin(), found.end(), [&](Index c) { return outside[c] != 0; });
        const Point at = trimming::cell_centre(octree, *hole);
        const std::string where = "seed " + place(options.seeds[i]);
        const std::string reason =
            seeds_inside
                ? fmt::format("leaks to the outside through {} cells, out of the surface near {}; close the "
                              "hole or use smaller cells",
                              found.size(), place(at))
                : "outside of the surface, nothing encloses it; add an outer box or move the seed";
        if (path) *path = std::move(found);
        return trim_error(ErrorCode::bad_input, where, reason);
    }
    return Done{};
}

/// Trims with a known side of the surface.
Result<TrimOutput> trim_side(const HexMesh& octree, const SurfaceQueries& queries, bool seeds_inside,
                             const TrimOptions& options, Context& context, std::vector<Index>* leak_path,
                             TrimMemory& memory) {
    const auto seed_cells = trimming::find_seed_cells(octree, options.seeds);
    if (!seed_cells) return seed_cells.error();
    const CellGraph graph = trimming::build_cell_graph(octree, context.parallel());
    const CellSides sides = trimming::find_sides(octree, graph, queries, context, memory);
    if (context.is_cancelled()) return trim_error(ErrorCode::cancelled, "", "cancelled");
    TrimOutput output;
    TrimReport& report = output.report;
    report.octree_cells = octree.cell_count();
    report.cut_cells = static_cast<std::size_t>(std::count(sides.cut.begin(), sides.cut.end(), 1));
    report.uncertain_cells = sides.uncertain_cells;
    KeptCells kept(octree, graph, sides, queries, context, report);
    kept.choose(options);
    if (Status ok = check_leaks(octree, graph, sides, options, *seed_cells, seeds_inside, kept, leak_path);
        !ok)
        return ok.error();
    kept.open_gaps();
    if (Status ok = mend_all(octree, graph, sides, options, *seed_cells, kept, report); !ok)
        return ok.error();
    if (context.is_cancelled()) return trim_error(ErrorCode::cancelled, "", "cancelled");
    trimming::Coverage coverage;
    const auto measure = [&] {
        return trimming::measure_coverage(octree, graph, sides, kept, queries, memory.keys(),
                                          context.parallel(), memory.surface());
    };
    if (options.seeds.empty()) coverage = measure();
    if (options.rule == TrimRule::centre && options.thinnest_wall_h > 0 && !coverage.spots.empty()) {
        const TrimReport before = report;
        const KeptCells::State state = kept.state();
        auto walls = trimming::find_wall_cells(octree, graph, sides, kept, queries, coverage.spots,
                                               options.thinnest_wall_h, context.parallel());
        for (bool sound = false; !sound && !walls.empty();) {
            for (const trimming::WallCell& wall : walls) kept.keep_wall(wall.cell, wall.middle);
            kept.open_gaps();
            if (Status ok = mend_all(octree, graph, sides, options, *seed_cells, kept, report); !ok)
                return ok.error();
            sound = trimming::drop_frayed_walls(graph, kept, walls) == 0;
            if (sound) continue;
            kept.restore(state);
            report = before;
        }
        report.wall_cells = walls.size();
        if (!walls.empty()) coverage = measure();
    }
    const trimming::PartialSides partial = trimming::find_partial_sides(octree, graph, kept);
    report.half_faces = partial.face_rows.size();
    report.half_edges = partial.edges.size();
    output.refine_cells = trimming::cells_to_refine(octree, graph, kept, partial);
    if (options.whole_layers) trimming::spread_over_layers(octree, graph, kept, output.refine_cells);
    if (options.seeds.empty()) {
        report.surface_area = coverage.area;
        report.bare_area = coverage.bare_area;
        output.bare_spots = std::move(coverage.spots);
        output.bare_parts = std::move(coverage.parts);
        if (!output.bare_spots.empty()) report.first_bare = output.bare_spots.front().at;
    }
    Result<HexMesh> mesh = trimming::emit_kept(octree, graph, kept.kept(), output.kept_cell);
    if (!mesh) return mesh.error();
    output.kept = std::move(mesh).value();
    report.kept_cells = output.kept.cell_count();
    for (Index c : output.kept_cell) report.kept_volume += trimming::cell_volume(octree, c);
    if (queries.is_closed()) report.enclosed_volume = enclosed_volume(queries.model());
    return output;
}

} // namespace

void TrimMemory::set_keys(std::vector<Index> keys) {
    keys_ = std::move(keys);
    const auto last = std::max_element(keys_.begin(), keys_.end());
    if (last != keys_.end() && side_.size() <= *last) side_.resize(*last + std::size_t{1});
    if (keys_.empty()) side_.shrink_to_fit();
}

SurfaceQueries& TrimMemory::queries(const BoundaryModel& model) {
    if (!queries_ || &queries_->model() != &model) queries_ = std::make_shared<SurfaceQueries>(model);
    queries_->choose_inside({});
    return *queries_;
}

Result<TrimOutput> trim(const HexMesh& octree, const Domain& domain, const TrimOptions& options,
                        Context& context, std::vector<Index>* leak_path, TrimMemory* memory) {
    if (Status ok = check_options(options); !ok) return ok.error();
    context.report("trim", 0);
    TrimMemory own;
    if (!memory) {
        std::vector<Index> keys(octree.cell_count());
        std::iota(keys.begin(), keys.end(), Index{0});
        own.set_keys(std::move(keys));
        memory = &own;
    }
    SurfaceQueries& queries = memory->queries(domain.model);
    const Result<WindingRange> side = trimming::choose_side(queries, options.seeds);
    if (!side) return side.error();
    const bool seeds_inside = side->low == WindingRange{}.low;
    if (!seeds_inside) queries.choose_inside(*side);
    Result<TrimOutput> output =
        trim_side(octree, queries, seeds_inside, options, context, leak_path, *memory);
    if (!output) return output;
    if (output->report.kept_cells == 0) {
        if (!output->bare_spots.empty()) return output;
        return trim_error(
            ErrorCode::bad_input, "near " + place(domain.model.triangle(0)[0]),
            domain.open_edges > 0
                ? fmt::format("no cell is inside the surface: it has {} open edges; close it, or "
                              "give seeds",
                              domain.open_edges)
                : "no cell is inside the surface, which encloses nothing there");
    }
    if (options.count_faults) count_faults(*output, context.parallel());
    return output;
}

void count_faults(TrimOutput& output, const Parallel& parallel) {
    const Topology topology = compute_topology(output.kept, parallel);
    const trimming::SurfaceFaults faults = trimming::check_surface(output.kept, topology);
    output.report.surface_quads = topology.boundary_faces.size();
    output.report.open_edges = faults.open_edges;
    output.report.nonmanifold_edges = faults.nonmanifold_edges;
    output.report.nonmanifold_vertices = faults.nonmanifold_vertices;
}

} // namespace hexopt
