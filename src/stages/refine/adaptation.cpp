#include "stages/refine/adaptation.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

Adaptation::Adaptation(const SurfaceElements& surface, SurfaceCriteria& criteria, const Regions& regions,
                       const RefineOptions& options, RefineOutput& out, Context& context)
    : surface_(surface), criteria_(criteria), regions_(regions), options_(options), out_(out),
      context_(context) {}

Status Adaptation::run() {
    const int deepest = out_.refinement.max_level();
    const int last = options_.max_level > 0 ? std::min(options_.max_level, deepest) : deepest;
    place_roots(last);
    for (int level = 0; level < last; ++level) {
        if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "refine", "", "cancelled");
        context_.report("refine", static_cast<double>(level) / last,
                        fmt::format("level {}, {} cells", level, out_.refinement.leaf_count()));
        if (!refine_level(level) && level >= out_.refinement.max_root_level()) break;
    }
    return Done{};
}

Status Adaptation::split_along_axes() {
    if (!regions_.has_axes()) return Done{};
    for (;;) {
        if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "refine", "", "cancelled");
        const std::vector<Index> leaves = out_.refinement.leaves();
        std::vector<AxisMask> axes(leaves.size());
        context_.parallel().for_each(leaves.size(), 1024, [&](std::size_t i) {
            axes[i] = regions_.axes_to_split(out_.refinement, leaves[i]);
        });
        std::vector<RefineRequest> requests;
        for (std::size_t i = 0; i < leaves.size(); ++i)
            if (axes[i] != 0) requests.push_back({leaves[i], axes[i]});
        if (requests.empty()) return Done{};
        const CellRefinement::Mark mark = out_.refinement.mark();
        const RefineCount count = out_.refinement.refine(requests, 1, options_.max_cells);
        constexpr auto kRegion = static_cast<std::size_t>(RefineCriterion::region);
        if (count.over_budget || out_.refinement.leaf_count() > options_.max_cells) {
            out_.refinement.go_back(mark);
            out_.stats.over_budget[kRegion] += requests.size();
            return Done{};
        }
        if (count.requested == 0) return Done{}; // no halvings left
        out_.stats.split[kRegion] += count.requested;
        out_.stats.balance += count.balance;
    }
}

void Adaptation::place_roots(int last) {
    const int smallest = out_.refinement.max_root_level();
    cells_.resize(static_cast<std::size_t>(std::max(last, smallest + 1)) + 1);
    const CellElements roots = find_root_elements(out_.refinement, surface_);
    for (std::size_t row = 0; row < roots.node.size(); ++row)
        cells_[out_.refinement.node(roots.node[row]).depth()].append(roots.node[row], roots.elements[row]);
    for (int k = 0; k <= smallest; ++k)
        descend(out_.refinement, surface_, context_.parallel(), cells_[k], cells_[k + 1]);
}

std::vector<Index> Adaptation::cut_leaves() const {
    std::vector<Index> leaves;
    for (const CellElements& cells : cells_)
        for (Index node : cells.node)
            if (node != kNoIndex) leaves.push_back(node);
    return leaves;
}

/// False when nothing is left to split.
bool Adaptation::refine_level(int level) {
    std::vector<Request> requests = find_requests(level);
    while (!requests.empty()) {
        if (split(level, requests)) return true;
        if (!give_up_last(requests)) return false;
    }
    return false;
}

std::vector<Adaptation::Request> Adaptation::find_requests(int level) const {
    const CellElements& cells = cells_[level];
    std::vector<RefineCriterion> why(cells.node.size(), RefineCriterion::count);
    context_.parallel().for_each(cells.node.size(), 64, [&](std::size_t row) {
        const Index node = cells.node[row];
        if (node == kNoIndex) return;
        why[row] =
            criteria_.ask({node_box(out_.refinement, node), node_size(out_.refinement, node, out_.mask),
                           out_.refinement.node(node).depth(), cells.elements[row]});
    });
    std::vector<Request> requests;
    for (std::size_t row = 0; row < why.size(); ++row)
        if (why[row] != RefineCriterion::count) requests.push_back({cells.node[row], why[row]});
    if (!criteria_.is_given_up(RefineCriterion::region)) append_region_requests(level, requests);
    return requests;
}

void Adaptation::append_region_requests(int level, std::vector<Request>& requests) const {
    if (regions_.empty()) return;
    const CellRefinement& refinement = out_.refinement;
    std::vector<std::uint8_t> wanted(refinement.node_count(), 0);
    context_.parallel().for_each(refinement.node_count(), 1024, [&](std::size_t n) {
        const Index node = static_cast<Index>(n);
        if (refinement.node(node).is_leaf() && refinement.node(node).depth() == level)
            wanted[n] = regions_.wants_split(refinement, node, out_.mask);
    });
    for (const Request& request : requests) wanted[request.node] = 0;
    for (Index node = 0; node < wanted.size(); ++node)
        if (wanted[node]) requests.push_back({node, RefineCriterion::region});
}

/// Cells of this level on the surface within surface_rings of one that is split and not among them. Fewer
/// fronts between levels then run along the wall.
std::vector<Index> Adaptation::spread(int level, const std::vector<Request>& requests) const {
    const CellElements& cells = cells_[level];
    std::vector<std::uint8_t> near(out_.refinement.vertex_count(), 0);
    std::vector<Index> fresh, found;
    for (const Request& request : requests)
        if (request.why != RefineCriterion::region) fresh.push_back(request.node);
    std::vector<std::uint8_t> marked(out_.refinement.node_count(), 0);
    for (const Request& request : requests) marked[request.node] = 1;
    for (int ring = 0; ring < options_.surface_rings; ++ring) {
        for (Index node : fresh)
            for (Index v : out_.refinement.node(node).vertices) near[v] = 1;
        fresh.clear();
        for (Index node : cells.node) {
            if (node == kNoIndex || marked[node]) continue;
            const Cell& cell = out_.refinement.node(node).vertices;
            if (std::none_of(cell.begin(), cell.end(), [&](Index v) { return near[v] != 0; })) continue;
            marked[node] = 1;
            fresh.push_back(node);
            found.push_back(node);
        }
    }
    return found;
}

/// Splits, or leaves everything as it is and returns false where there would be too many cells.
bool Adaptation::split(int level, const std::vector<Request>& requests) {
    const CellRefinement::Mark mark = out_.refinement.mark();
    std::vector<std::vector<Index>> nodes;
    for (const CellElements& cells : cells_) nodes.push_back(cells.node);
    const RefineStats stats = out_.stats;
    if (try_split(level, requests)) return true;
    out_.refinement.go_back(mark);
    for (std::size_t k = 0; k < cells_.size(); ++k) cells_[k].go_back(std::move(nodes[k]));
    out_.stats = stats;
    return false;
}

bool Adaptation::try_split(int level, const std::vector<Request>& requests) {
    const std::vector<Index> neighbours = spread(level, requests);
    std::vector<RefineRequest> all;
    for (const Request& request : requests) all.push_back({request.node, out_.mask});
    for (Index node : neighbours) all.push_back({node, out_.mask});
    const RefineCount count = out_.refinement.refine(all, options_.rings, options_.max_cells);
    if (count.over_budget) return false;
    for (const Request& request : requests) ++out_.stats.split[static_cast<std::size_t>(request.why)];
    out_.stats.spread += neighbours.size();
    out_.stats.balance += count.balance;
    for (int k = 0; k <= level; ++k)
        descend(out_.refinement, surface_, context_.parallel(), cells_[k], cells_[k + 1]);
    return surround_surface(out_.stats);
}

/// Trimming leaves a staircase of cells that the surface cuts and of their neighbours: all of one level.
bool Adaptation::surround_surface(RefineStats& stats) {
    if (options_.surface_layers == 0) return true;
    const std::vector<Index> leaves = cut_leaves();
    const RefineCount count =
        out_.refinement.surround(leaves, options_.surface_layers, options_.rings, options_.max_cells);
    if (count.over_budget) return false;
    stats.layers += count.balance;
    for (std::size_t k = 0; k + 1 < cells_.size(); ++k)
        descend(out_.refinement, surface_, context_.parallel(), cells_[k], cells_[k + 1]);
    return true;
}

/// Drops the requests of the last criterion among them for good; false if there was but one.
bool Adaptation::give_up_last(std::vector<Request>& requests) {
    RefineCriterion last = RefineCriterion::surface_size, first = RefineCriterion::count;
    for (const Request& request : requests) {
        last = std::max(last, request.why);
        first = std::min(first, request.why);
    }
    const std::size_t before = requests.size();
    std::erase_if(requests, [&](const Request& request) { return request.why == last; });
    out_.stats.over_budget[static_cast<std::size_t>(last)] += before - requests.size();
    criteria_.give_up(last);
    return first != last;
}

} // namespace hexopt
