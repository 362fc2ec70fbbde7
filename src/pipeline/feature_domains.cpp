#include "pipeline/feature_domains.hpp"

#include "domain/drop_curves.hpp"
#include "domain/narrow_curves.hpp"

#include <algorithm>

namespace hexopt {

namespace {

/// Share of a curve's vertices at cells that failed from which the curve is held to be the cause.
constexpr double kNoisyShare = 0.25;

/// Numbers in the whole domain of an attempt's curves.
std::vector<Index> whole_numbers(const MeshAttempt& attempt, const Domain& own, const Domain& whole) {
    std::vector<Index> number;
    for (Index c = 0; c < whole.model.curve_count(); ++c)
        if (!std::binary_search(attempt.dropped.begin(), attempt.dropped.end(), c)) number.push_back(c);
    if (number.size() != own.model.curve_count()) number.clear();
    return number;
}

/// Visits the curves that a vertex is bound to: its own, or those that end at its corner.
template <class Visit>
void for_each_curve(const Association& bound, const Domain& domain, const Visit& visit) {
    if (bound.kind == EntityKind::curve) visit(bound.entity);
    if (bound.kind == EntityKind::corner)
        for (Index c : domain.corner_curve[bound.entity]) visit(c);
}

/// Vertices of cells that failed, where none did of low ones, and of those that share a vertex with one.
std::vector<std::uint8_t> vertices_near_failures(const MeshAttempt& attempt) {
    const HexMesh& mesh = attempt.fitted.mesh;
    std::vector<std::uint8_t> near(mesh.vertex_count(), 0);
    for (Index cell : attempt.failed.empty() ? attempt.low : attempt.failed)
        for (Index v : mesh.cells[cell])
            for (CellCorner round : attempt.topology.vertex_cell[v])
                for (Index u : mesh.cells[round.cell]) near[u] = 1;
    return near;
}

} // namespace

Status FeatureDomains::split(std::span<const CurveCut> cuts, Context& context) {
    if (cuts.empty()) return Done{};
    auto split = split_curves(whole_, cuts, context);
    if (!split) return split.error();
    whole_ = std::move(*split);
    reduced_.reset();
    return Done{};
}

Result<Domain*> FeatureDomains::without(std::span<const Index> curves, Context& context) {
    if (curves.empty()) return &whole_;
    if (!reduced_ || !std::equal(curves.begin(), curves.end(), dropped_.begin(), dropped_.end())) {
        auto reduced = drop_curves(whole_, curves, context);
        if (!reduced) return reduced.error();
        reduced_ = std::move(*reduced);
        dropped_.assign(curves.begin(), curves.end());
    }
    return &*reduced_;
}

std::vector<Index> find_noisy_curves(const MeshAttempt& attempt, const Domain& own, const Domain& whole,
                                     double below_deg) {
    const std::vector<Index> number = whole_numbers(attempt, own, whole);
    const std::vector<std::uint8_t> near = vertices_near_failures(attempt);
    std::vector<std::size_t> at_failures(number.size(), 0), total(number.size(), 0);
    const std::vector<Association>& bound = attempt.fitted.association;
    for (Index v = 0; v < bound.size(); ++v)
        for_each_curve(bound[v], own, [&](Index c) {
            if (c >= number.size()) return;
            ++total[c];
            at_failures[c] += near[v];
        });
    std::vector<Index> noisy;
    for (std::size_t c = 0; c < number.size(); ++c)
        if (at_failures[c] > 0 &&
            static_cast<double>(at_failures[c]) >= kNoisyShare * static_cast<double>(total[c]) &&
            may_give_up(whole, number[c], below_deg))
            noisy.push_back(number[c]);
    return noisy;
}

std::vector<Index> cells_elsewhere(const std::vector<Index>& cells, const MeshAttempt& attempt,
                                   const Domain& own, const Domain& whole, std::span<const Index> curves) {
    const std::vector<Index> number = whole_numbers(attempt, own, whole);
    const HexMesh& mesh = attempt.fitted.mesh;
    const auto is_at_curve = [&](Index v) {
        bool found = false;
        for_each_curve(attempt.fitted.association[v], own, [&](Index c) {
            found |= c < number.size() && std::binary_search(curves.begin(), curves.end(), number[c]);
        });
        return found;
    };
    std::vector<Index> left;
    for (Index cell : cells) {
        bool found = false;
        for (Index v : mesh.cells[cell])
            for (CellCorner round : attempt.topology.vertex_cell[v])
                for (Index u : mesh.cells[round.cell]) found = found || is_at_curve(u);
        if (!found) left.push_back(cell);
    }
    return left;
}

} // namespace hexopt
