#include "pipeline/feature_domains.hpp"

#include "domain/drop_curves.hpp"
#include "domain/narrow_curves.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

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

std::vector<Index> number_corners(const BoundaryModel& whole, const BoundaryModel& own) {
    const auto key = [](const Point& p) { return std::array{p.x, p.y, p.z}; };
    std::map<std::array<double, 3>, Index> by_place;
    for (Index c = 0; c < own.corner_count(); ++c) by_place[key(own.corner_point(c))] = c;
    std::vector<Index> number(whole.corner_count(), kNoIndex);
    for (Index c = 0; c < number.size(); ++c)
        if (const auto found = by_place.find(key(whole.corner_point(c))); found != by_place.end())
            number[c] = found->second;
    return number;
}

/// The middle of a patch's largest triangle.
Point place_on(const BoundaryModel& model, Index patch) {
    double largest = -1;
    Point place{};
    for (auto [t, last] = model.patch_triangles(patch); t < last; ++t) {
        const auto& [a, b, c] = model.triangle(t);
        const Point area = glm::cross(b - a, c - a);
        if (glm::dot(area, area) <= largest) continue;
        largest = glm::dot(area, area);
        place = (a + b + c) / 3.0;
    }
    return place;
}

std::vector<Index> number_patches(const BoundaryModel& whole, const BoundaryModel& own) {
    std::vector<Index> number;
    for (Index p = 0; p < whole.patch_count(); ++p)
        number.push_back(own.patch_of_triangle(own.project_patch(kNoIndex, place_on(whole, p)).element));
    return number;
}

/// `to` of what is `from` at the same place; kNoIndex where that differs.
std::vector<Index> join_numbers(const std::vector<Index>& from, const std::vector<Index>& to) {
    constexpr Index kNotYet = kNoIndex - 1;
    std::vector<Index> joined;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (from[i] == kNoIndex) continue;
        if (from[i] >= joined.size()) joined.resize(from[i] + 1, kNotYet);
        Index& known = joined[from[i]];
        known = known == kNotYet || known == to[i] ? to[i] : kNoIndex;
    }
    std::replace(joined.begin(), joined.end(), kNotYet, kNoIndex);
    return joined;
}

/// Numbers without those `dropped`, which rise.
std::vector<Index> number_left(std::size_t count, std::span<const Index> dropped) {
    std::vector<Index> number(count, kNoIndex);
    Index next = 0;
    for (Index c = 0; c < count; ++c)
        if (!std::binary_search(dropped.begin(), dropped.end(), c)) number[c] = next++;
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
    numbers_.clear();
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

Result<const FeatureDomains::OwnNumbers*> FeatureDomains::numbers_without(std::span<const Index> curves,
                                                                          Context& context) {
    const std::vector<Index> key(curves.begin(), curves.end());
    if (!numbers_.contains(key)) {
        const auto own = without(curves, context);
        if (!own) return own.error();
        const BoundaryModel& model = (*own)->model;
        numbers_[key] = {number_patches(whole_.model, model), number_corners(whole_.model, model)};
    }
    return &numbers_.at(key);
}

Result<EntityMap> FeatureDomains::map(std::span<const Index> from, std::span<const Index> to,
                                      Context& context) {
    const auto source = numbers_without(from, context), target = numbers_without(to, context);
    if (!source) return source.error();
    if (!target) return target.error();
    const std::size_t curves = whole_.model.curve_count();
    return EntityMap{join_numbers((*source)->patch, (*target)->patch),
                     join_numbers(number_left(curves, from), number_left(curves, to)),
                     join_numbers((*source)->corner, (*target)->corner)};
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
