#include "stages/refine/refine.hpp"

#include "stages/refine/criteria.hpp"
#include "stages/refine/default_size.hpp"
#include "stages/refine/initial_mesh.hpp"
#include "stages/refine/surface_elements.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

const char* name_of(RefineCriterion criterion) {
    switch (criterion) {
    case RefineCriterion::surface_size:
        return "surface_size";
    case RefineCriterion::normal_angle:
        return "normal_angle";
    case RefineCriterion::count:
        break;
    }
    return "none";
}

namespace {

Error usage(const std::string& option, const std::string& reason) {
    return make_error(ErrorCode::usage, "refine", option, reason);
}

Status check_options(const RefineOptions& options) {
    const auto in = [](double x, double low, double high) { return x >= low && x <= high; };
    if (!in(options.normal_angle_deg, 1, 180)) return usage("normal_angle_deg", "must be in 1..180");
    if (!in(options.curvature_levels, 0, 20)) return usage("curvature_levels", "must be in 0..20");
    if (!in(options.rings, 1, 20)) return usage("rings", "must be in 1..20");
    if (!in(options.surface_rings, 0, 20)) return usage("surface_rings", "must be in 0..20");
    if (!in(options.target_cells, 100, 1e9)) return usage("target_cells", "must be in 100..1e9");
    if (!in(options.surface_layers, 0, 20)) return usage("surface_layers", "must be in 0..20");
    if (options.max_level < 0) return usage("max_level", "must not be negative");
    if (!(options.initial.base_size >= 0) || !std::isfinite(options.initial.base_size))
        return usage("base_size", "must be positive and finite, or 0");
    if (!(options.surface.size >= 0) || !std::isfinite(options.surface.size))
        return usage("surface size", "must be positive and finite, or 0");
    return Done{};
}

/// One run: carries the cells that meet the surface down the levels.
class Adaptation {
  public:
    Adaptation(const SurfaceElements& surface, const SurfaceCriteria& criteria, const RefineOptions& options,
               RefineOutput& out, Context& context)
        : surface_(surface), criteria_(criteria), options_(options), out_(out), context_(context) {}

    Status run() {
        const int last = options_.max_level > 0 ? std::min(options_.max_level, out_.refinement.max_level())
                                                : out_.refinement.max_level();
        cells_.resize(static_cast<std::size_t>(last) + 1);
        cells_[0] = find_root_elements(out_.refinement, surface_);
        for (int level = 0; level < last; ++level) {
            if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "refine", "", "cancelled");
            context_.report("refine", static_cast<double>(level) / last,
                            fmt::format("level {}, {} cells", level, out_.refinement.leaf_count()));
            if (!refine_level(level)) break;
        }
        surround_surface();
        return Done{};
    }

  private:
    /// Trimming leaves a staircase of cells that the surface cuts and of their neighbours: all of one level.
    void surround_surface() {
        if (options_.surface_layers == 0) return;
        std::vector<Index> on_surface;
        for (const CellElements& cells : cells_)
            for (Index node : cells.node)
                if (node != kNoIndex) on_surface.push_back(node);
        const RefineCount count =
            out_.refinement.surround(on_surface, options_.surface_layers, options_.max_cells);
        if (count.over_budget) out_.stats.budget_refused += on_surface.size();
        out_.stats.layers = count.balance;
    }

    bool refine_level(int level) {
        CellElements& cells = cells_[level];
        const std::vector<RefineCriterion> why = ask_all(cells);
        std::vector<std::uint8_t> marked(cells.node.size(), 0);
        for (std::size_t row = 0; row < why.size(); ++row) marked[row] = why[row] != RefineCriterion::count;
        const std::size_t asked = static_cast<std::size_t>(std::count(marked.begin(), marked.end(), 1));
        if (asked == 0) return false;
        spread(cells, marked);
        std::vector<RefineRequest> requests;
        for (std::size_t row = 0; row < marked.size(); ++row)
            if (marked[row]) requests.push_back({cells.node[row], out_.mask});
        const RefineCount count = out_.refinement.refine(requests, options_.rings, options_.max_cells);
        if (count.over_budget) {
            out_.stats.budget_refused += requests.size();
            return false;
        }
        for (RefineCriterion criterion : why)
            if (criterion != RefineCriterion::count) ++out_.stats.split[static_cast<std::size_t>(criterion)];
        out_.stats.spread += requests.size() - asked;
        out_.stats.balance += count.balance;
        for (int k = 0; k <= level; ++k)
            descend(out_.refinement, surface_, context_.parallel(), cells_[k], cells_[k + 1]);
        return true;
    }

    std::vector<RefineCriterion> ask_all(const CellElements& cells) const {
        std::vector<RefineCriterion> why(cells.node.size(), RefineCriterion::count);
        context_.parallel().for_each(cells.node.size(), 64, [&](std::size_t row) {
            if (cells.node[row] != kNoIndex)
                why[row] = criteria_.ask(out_.refinement, cells.node[row], cells.elements[row], surface_);
        });
        return why;
    }

    /// Marks the cells of this level on the surface within surface_rings of a marked one, so that fewer
    /// fronts between levels run along the wall.
    void spread(const CellElements& cells, std::vector<std::uint8_t>& marked) const {
        std::vector<std::uint8_t> near(out_.refinement.vertex_count(), 0);
        for (int ring = 0; ring < options_.surface_rings; ++ring) {
            for (std::size_t row = 0; row < marked.size(); ++row)
                if (marked[row])
                    for (Index v : out_.refinement.node(cells.node[row]).vertices) near[v] = 1;
            for (std::size_t row = 0; row < marked.size(); ++row) {
                if (marked[row] || cells.node[row] == kNoIndex) continue;
                const Cell& cell = out_.refinement.node(cells.node[row]).vertices;
                marked[row] = std::any_of(cell.begin(), cell.end(), [&](Index v) { return near[v] != 0; });
            }
        }
    }

    const SurfaceElements& surface_;
    const SurfaceCriteria& criteria_;
    const RefineOptions& options_;
    RefineOutput& out_;
    Context& context_;
    std::vector<CellElements> cells_; ///< by level
};

void rebuild(RefineOutput& out, Context& context) {
    LeafMesh leaves = out.refinement.leaf_mesh(context.parallel());
    leaves.mesh.revision = out.octree.revision + 1;
    out.octree = std::move(leaves.mesh);
    out.leaf_node = std::move(leaves.leaf_node);
    out.stats.level_cells.clear();
    for (std::uint8_t level : out.octree.level) {
        if (level >= out.stats.level_cells.size()) out.stats.level_cells.resize(level + std::size_t{1});
        ++out.stats.level_cells[level];
    }
}

double longest_root_edge(const CellRefinement& refinement) {
    double longest = 0;
    for (Index root = 0; root < refinement.root_count(); ++root)
        longest = std::max(longest, node_size(refinement, root));
    return longest;
}

} // namespace

Result<RefineOutput> refine(const Domain& domain, const RefineOptions& options, Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    Result<Start> start = choose_start(domain, options);
    if (!start) return start.error();
    Result<CellRefinement> made = CellRefinement::create(std::move(start->mesh), context.parallel());
    if (!made) return made.error();
    Result<SurfaceCriteria> criteria = SurfaceCriteria::create(domain, options, start->surface);
    if (!criteria) return criteria.error();
    RefineOutput out{
        std::move(made).value(), {}, {}, {}, options.planar ? AxisMask{3} : kAllAxes, options.rings,
        options.max_cells};
    out.stats.base_size = longest_root_edge(out.refinement);
    out.stats.surface_size = start->surface.level >= 0
                                 ? std::ldexp(out.stats.base_size, -start->surface.level)
                                 : start->surface.size;
    const SurfaceElements surface(domain);
    if (Status ok = Adaptation(surface, *criteria, options, out, context).run(); !ok) return ok.error();
    rebuild(out, context);
    context.report("refine", 1, fmt::format("{} cells", out.octree.cell_count()));
    return out;
}

RefineCount refine_cells(RefineOutput& out, std::span<const Index> cells, Context& context) {
    std::vector<RefineRequest> requests;
    for (Index cell : cells) requests.push_back({out.leaf_node[cell], out.mask});
    // The front moves as little as the balance allows: these are repairs at the wall.
    const RefineCount count = out.refinement.refine(requests, 1, out.max_cells);
    if (count.over_budget) out.stats.budget_refused += cells.size();
    out.stats.balance += count.balance;
    rebuild(out, context);
    return count;
}

} // namespace hexopt
