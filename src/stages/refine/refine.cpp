#include "stages/refine/refine.hpp"

#include "stages/refine/adaptation.hpp"
#include "stages/refine/initial_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <utility>

namespace hexopt {

const char* name_of(RefineCriterion criterion) {
    switch (criterion) {
    case RefineCriterion::surface_size:
        return "surface_size";
    case RefineCriterion::curve_size:
        return "curve_size";
    case RefineCriterion::region:
        return "region";
    case RefineCriterion::normal_angle:
        return "normal_angle";
    case RefineCriterion::gap:
        return "gap";
    case RefineCriterion::feature:
        return "feature";
    case RefineCriterion::count:
        break;
    }
    return "none";
}

bool RefineStats::budget_hit() const {
    return repairs_over_budget > 0 ||
           std::any_of(over_budget.begin(), over_budget.end(), [](std::size_t n) { return n > 0; });
}

std::string RefineStats::describe_budget() const {
    if (!budget_hit()) return {};
    std::string unsplit;
    const auto add = [&](std::size_t cells, const std::string& what) {
        if (cells > 0) unsplit += fmt::format("{}{} for {}", unsplit.empty() ? "" : ", ", cells, what);
    };
    for (std::size_t c = 0; c < kCriterionCount; ++c) {
        std::string name = name_of(static_cast<RefineCriterion>(c));
        std::replace(name.begin(), name.end(), '_', ' ');
        add(over_budget[c], name);
    }
    add(repairs_over_budget, "repairs");
    return "The budget of cells was used up: cells were left as large as they are, " + unsplit + '.';
}

namespace {

Error usage(const std::string& option, const std::string& reason) {
    return make_error(ErrorCode::usage, "refine", option, reason);
}

struct NumberRange {
    const char* option;
    double value, low, high;
};

Status check_target(const TargetSize& target, const std::string& where) {
    if (!(target.size >= 0) || !std::isfinite(target.size))
        return usage(where, "size must be positive and finite");
    if (target.size > 0 && target.level >= 0) return usage(where, "give a size or a level, not both");
    return Done{};
}

Status check_options(const RefineOptions& options) {
    const std::array<NumberRange, 14> ranges = {{
        {"chord_error_rel", options.chord_error_rel, 0, 1},
        {"normal_angle_deg", options.normal_angle_deg, 1, 180},
        {"curvature_levels", double(options.curvature_levels), 0, 20},
        {"gap_cells", options.gap_cells, 0, 100},
        {"wall_cells", options.wall_cells, 0, 100},
        {"feature_cells", options.feature_cells, 0, 100},
        {"outer_levels", double(options.outer_levels), 0, 20},
        {"gap_levels", double(options.gap_levels), 0, 20},
        {"max_level", double(options.max_level), 0, 20},
        {"rings", double(options.rings), 1, 20},
        {"surface_rings", double(options.surface_rings), 0, 20},
        {"surface_layers", double(options.surface_layers), 0, 20},
        {"target_cells", options.target_cells, 0, 1e10},
        {"base_size", options.initial.base_size, 0, 1e300},
    }};
    for (const NumberRange& range : ranges)
        if (!(range.value >= range.low && range.value <= range.high))
            return usage(range.option, fmt::format("must be in {}..{}", range.low, range.high));
    if (Status ok = check_target(options.surface, "surface"); !ok) return ok;
    for (const PatchTarget& entry : options.patches) {
        if (Status ok = check_target(entry.target, "patch '" + entry.patch + "'"); !ok) return ok;
        if (!entry.target.is_given()) return usage("patch '" + entry.patch + "'", "has no target size");
    }
    for (const CurveTarget& entry : options.curves) {
        if (Status ok = check_target(entry.target, "curve"); !ok) return ok;
        if (!entry.target.is_given()) return usage("curve", "has no target size");
    }
    for (const RegionTarget& region : options.regions)
        if (Status ok = check_target(region.target, "region"); !ok) return ok;
    const InitialMeshOptions& initial = options.initial;
    const bool counted = initial.cells != std::array<Index, 3>{0, 0, 0};
    if (initial.mesh && (initial.box || counted || initial.base_size > 0))
        return usage("initial mesh", "a mesh excludes a box, counts of cells and a base size");
    if (counted && initial.base_size > 0) return usage("base_size", "excludes counts of cells");
    return Done{};
}

void rebuild(RefineOutput& out, Context& context) {
    const auto revision = out.octree.revision;
    out.octree = {}; // no room for two
    out.leaf_node = {};
    LeafMesh leaves = out.refinement.leaf_mesh(context.parallel());
    leaves.mesh.revision = revision + 1;
    out.octree = std::move(leaves.mesh);
    out.leaf_node = std::move(leaves.leaf_node);
    out.stats.level_cells.clear();
    for (std::uint8_t level : out.octree.level) {
        if (level >= out.stats.level_cells.size()) out.stats.level_cells.resize(level + std::size_t{1});
        ++out.stats.level_cells[level];
    }
}

double longest_root_edge(const CellRefinement& refinement, AxisMask mask) {
    double longest = 0;
    for (Index root = 0; root < refinement.root_count(); ++root)
        longest = std::max(longest, node_size(refinement, root, mask));
    return longest;
}

/// Fraction of leaves whose centre is inside the domain, from at most some thousands of them.
double inside_fraction(const Domain& domain, const CellRefinement& refinement, Context& context) {
    constexpr std::size_t kSamples = 8000;
    const std::vector<Index> leaves = refinement.leaves();
    const std::size_t step = std::max<std::size_t>(1, leaves.size() / kSamples), count = leaves.size() / step;
    const auto is_inside = [&](std::size_t i) {
        Point centre(0);
        for (Index v : refinement.node(leaves[i * step + step / 2]).vertices)
            centre += refinement.position(v) / 8.0;
        const Projection nearest = domain.model.project_patch(kNoIndex, centre);
        return glm::dot(centre - nearest.point, nearest.direction) < 0;
    };
    const auto inside = context.parallel().reduce<std::size_t>(
        count, 256, 0,
        [&](std::size_t begin, std::size_t end) {
            std::size_t sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += is_inside(i);
            return sum;
        },
        [](std::size_t a, std::size_t b) { return a + b; });
    return static_cast<double>(inside) / static_cast<double>(count);
}

} // namespace

class SizeTrials::Run {
  public:
    Run(const Domain& domain, const RefineOptions& options, Context& context)
        : domain_(domain), options_(options), most_cells_(options.max_cells), context_(context),
          surface_(domain, options.planar), criteria_(domain, surface_, options) {
        if (options.surface.is_given()) require_steep();
    }

    Result<Trial> refine_to(const TargetSize& size) {
        Result<HexMesh> mesh = make_initial_mesh(domain_, options_, size);
        if (!mesh) return mesh.error();
        Result<CellRefinement> made = CellRefinement::create(std::move(mesh).value(), context_.parallel());
        if (!made) return made.error();
        made->balance(options_.max_cells);
        if (Status ok = criteria_.set_size(options_, size); !ok) return ok.error();
        Result<Regions> regions = Regions::create(domain_, options_);
        if (!regions) return regions.error();
        if (regions->has_axes() && options_.planar)
            return usage("region", "three sizes are for meshes in space");
        if (regions->has_axes() && made->max_root_level() > 0)
            return usage("region", "three sizes need an initial mesh without hanging vertices");
        Trial trial{{std::move(made).value(),
                     {},
                     {},
                     {},
                     options_.planar ? AxisMask{3} : kAllAxes,
                     options_.max_cells,
                     {}},
                    0,
                    0};
        RefineOutput& out = trial.out;
        out.stats.base_size = longest_root_edge(out.refinement, out.mask);
        out.finest_size = criteria_.finest_sizes(out.stats.base_size);
        out.stats.surface_size = size.level >= 0 ? std::ldexp(out.stats.base_size, -size.level) : size.size;
        Adaptation adaptation(surface_, criteria_, *regions, options_, out, context_);
        if (Status ok = adaptation.run(); !ok) return ok.error();
        if (Status ok = adaptation.split_along_axes(); !ok) return ok.error();
        if (options_.surface.is_given()) return trial;
        trial.inside = static_cast<double>(out.refinement.leaf_count()) *
                       inside_fraction(domain_, out.refinement, context_);
        trial.cut = adaptation.cut_leaves().size();
        return trial;
    }

    RefineOutput finish(Trial trial) const {
        RefineOutput out = std::move(trial.out);
        out.max_cells = most_cells_;
        rebuild(out, context_);
        context_.report("refine", 1, fmt::format("{} cells", out.octree.cell_count()));
        return out;
    }

    double first_size(double cells) const { return hexopt::first_size(domain_, cells, options_.planar); }

    /// The surface's size that gives about the wanted number of cells.
    Result<Trial> search() {
        double size = 0;
        {
            Result<Trial> trial = search_without_steep();
            if (!trial) return trial;
            auto steep = allow_steep(*trial);
            if (!steep) return steep.error();
            if (!*steep) return trial;
            const double ratio = promised(**steep) / wanted_cells(options_);
            if (ratio < kMany) return std::move(**steep);
            size = (*steep)->out.stats.surface_size * std::pow(ratio, growth_power());
        } // neither octree stays while another is made
        return refine_to({size, -1});
    }

    /// One trial of a quarter of the cells wanted, then corrections by the law with which cells on a surface
    /// (2-D: on a line) grow, between the nearest sizes known to give too many and too few.
    Result<Trial> search_without_steep() {
        const double wanted = wanted_cells(options_);
        double size = first_size(wanted / 4), too_small = 0, too_large = 1e300;
        if (!(size > 0)) return usage("surface", "has no extent");
        Result<Trial> trial = refine_to({size, -1});
        for (int round = 0; round < kRounds && trial; ++round) {
            const double ratio = promised(*trial) / wanted;
            if (round > 0 && ratio > kFew && ratio < kMany) break;
            (ratio > 1 ? too_small : too_large) = size;
            size *= std::pow(ratio, growth_power());
            if (size <= too_small || size >= too_large) size = std::sqrt(too_small * too_large);
            trial = refine_to({size, -1});
        }
        return trial;
    }

    /// Refines once more with a level more for steep chords, now and from now on; none, and then never, where
    /// that adds many cells: with the number given all others would have to be larger.
    Result<std::optional<Trial>> allow_steep(const Trial& without) {
        criteria_.set_steep(kSteep);
        // Leaves grow as what they promise: so many are too many, and need not all be made.
        const auto leaves = static_cast<double>(without.out.refinement.leaf_count());
        const std::size_t most =
            std::exchange(options_.max_cells,
                          std::min(options_.max_cells, static_cast<std::size_t>(kMostSteepLeaves * leaves)));
        auto with = refine_to({without.out.stats.surface_size, -1});
        options_.max_cells = most;
        if (!with) return with.error();
        const bool fits = with->out.stats.over_budget == without.out.stats.over_budget;
        const double more = promised(*with) / promised(without);
        context_.log(LogLevel::debug, fmt::format("steep chords: {:.2f} times the cells", more));
        if (fits && more <= kMostSteep) return std::optional(std::move(*with));
        criteria_.set_steep(0);
        return std::optional<Trial>();
    }

    void require_steep() { criteria_.set_steep(kSteep); }

    /// Criteria that need many times the wanted number are given up.
    void limit_leaves() {
        const double most = kMostLeaves * wanted_cells(options_);
        options_.max_cells = std::min(options_.max_cells, static_cast<std::size_t>(most));
    }

  private:
    static constexpr int kRounds = 4;
    static constexpr double kMostLeaves = 6; ///< per wanted cell; ordinary surfaces need 1.5 to 3
    /// Buffer cells and cells that trimming keeps beyond the centre rule, per cell that the surface cuts.
    static constexpr double kBufferShare = 0.7;
    /// Times what is allowed from which a chord is steep, and cells with them over those without, at the
    /// most.
    static constexpr double kSteep = 2, kMostSteep = 2.1;
    static constexpr double kMostSteepLeaves = 2.6; ///< times those without, with a margin

    /// Cells promised over those wanted that do.
    static constexpr double kFew = 0.6, kMany = 1.5;

    double growth_power() const { return options_.planar ? 1 : 0.5; }
    static double promised(const Trial& trial) {
        return trial.inside + kBufferShare * static_cast<double>(trial.cut);
    }

    const Domain& domain_;
    RefineOptions options_;
    std::size_t most_cells_; ///< of the finished octree, repairs included
    Context& context_;
    SurfaceElements surface_;
    SurfaceCriteria criteria_;
};

namespace {

/// Of requests that do not fit into the budget the first half, quarter ... is tried.
constexpr std::size_t kLeastPart = 16;

} // namespace

double wanted_cells(const RefineOptions& options) {
    /// Of max_cells, so that a size found for it stays below it.
    constexpr double kShare = 0.8;
    if (options.surface.is_given()) return 0;
    const double wanted = options.target_cells > 0 ? options.target_cells : options.planar ? 20e3 : 100e3;
    return std::min(wanted, kShare * static_cast<double>(options.max_cells));
}

Result<RefineOutput> refine(const Domain& domain, const RefineOptions& options, Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    SizeTrials::Run run(domain, options, context);
    if (!options.surface.is_given()) run.limit_leaves();
    Result<SizeTrials::Trial> trial =
        options.surface.is_given() ? run.refine_to(options.surface) : run.search();
    if (!trial) return trial.error();
    return run.finish(std::move(*trial));
}

SizeTrials::SizeTrials(std::unique_ptr<Run> run) : run_(std::move(run)) {}
SizeTrials::SizeTrials(SizeTrials&&) noexcept = default;
SizeTrials::~SizeTrials() = default;

Result<SizeTrials> SizeTrials::create(const Domain& domain, const RefineOptions& options, Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (options.surface.is_given()) return usage("surface", "sizes are tried where none is given");
    auto run = std::make_unique<Run>(domain, options, context);
    run->limit_leaves();
    return SizeTrials(std::move(run));
}

Result<std::optional<SizeTrials::Trial>> SizeTrials::allow_steep(const Trial& without) {
    return run_->allow_steep(without);
}

void SizeTrials::require_steep() { run_->require_steep(); }

double SizeTrials::first_size(double cells) const { return run_->first_size(cells); }

Result<SizeTrials::Trial> SizeTrials::refine_to(double size) {
    if (!(size > 0) || !std::isfinite(size)) return usage("surface", "the size must be positive and finite");
    return run_->refine_to({size, -1});
}

RefineOutput SizeTrials::finish(Trial trial) const { return run_->finish(std::move(trial)); }

RefineCount refine_cells(RefineOutput& out, std::span<const Index> cells, Context& context) {
    std::vector<RefineRequest> requests;
    for (Index cell : cells) requests.push_back({out.leaf_node[cell], out.mask});
    RefineCount count;
    std::size_t part = requests.size();
    for (; part > requests.size() / kLeastPart; part /= 2) {
        // The front moves as little as the balance allows: these are repairs at the wall.
        count = out.refinement.refine(std::span(requests).first(part), 1, out.max_cells);
        if (!count.over_budget) break;
    }
    if (part < requests.size()) {
        out.stats.repairs_over_budget += requests.size() - (count.over_budget ? 0 : part);
        count.over_budget = true;
    }
    out.stats.balance += count.balance;
    rebuild(out, context);
    return count;
}

} // namespace hexopt
