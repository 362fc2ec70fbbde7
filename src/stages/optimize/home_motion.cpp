#include "stages/optimize/home_motion.hpp"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace hexopt {

HomeMotion::HomeMotion(const Problem& problem, const BoundaryModel& surface, std::span<const Hold> hold,
                       std::span<const Point> anchor)
    : problem_(problem), surface_(surface), hold_(hold), anchor_(anchor), last_(problem.dof_count()) {
    const auto bound = surface.associations();
    for (Index d = 0; d < problem.dof_count(); ++d)
        if (bound[problem.dof_vertex()[d]].kind != EntityKind::interior) on_surface_.push_back(d);
}

void HomeMotion::update(double pull) {
    std::vector<double> count(problem_.dof_count(), 0);
    stiffness_.assign(problem_.dof_count(), 0);
    for (std::size_t c = 0; c < problem_.cell_count(); ++c)
        for (Index v : problem_.cell(c)) {
            const Index d = problem_.vertex_dof(v);
            if (d == kNoIndex) continue;
            const double inverse = problem_.inverse_length()[c];
            stiffness_[d] += problem_.weight()[c] * inverse * inverse;
            count[d] += 1;
        }
    limited_.clear();
    const auto bound = surface_.associations();
    for (Index d = 0; d < problem_.dof_count(); ++d) {
        const Index v = problem_.dof_vertex()[d];
        stiffness_[d] *= count[d] > 0 ? pull / count[d] : 0;
        if (bound[v].kind != EntityKind::interior && (hold_[v] == Hold::drawn || hold_[v] == Hold::anchored))
            limited_.push_back(d);
    }
}

const Projection& HomeMotion::project(Index dof, const Point& query) const {
    Last& last = last_[dof];
    if (last.is_known && last.query == query) return last.at;
    last.at = surface_.project(surface_.associations()[problem_.dof_vertex()[dof]], query, last.at.element);
    last.query = query;
    last.is_known = true;
    return last.at;
}

void HomeMotion::freedoms(std::span<const Point> positions, std::span<Freedom> out) const {
    const auto bound = surface_.associations();
    for (std::size_t i = 0; i < out.size(); ++i) {
        const Index d = on_surface_[i], v = problem_.dof_vertex()[d];
        out[i] = {};
        if (hold_[v] == Hold::drawn || hold_[v] == Hold::anchored) continue;
        out[i] = {Freedom::none, Point(0)};
        if (bound[v].kind == EntityKind::corner || hold_[v] == Hold::fixed) continue;
        const Projection& at = project(d, positions[v]);
        out[i] = {bound[v].kind == EntityKind::patch ? Freedom::plane : Freedom::line, at.direction};
    }
}

Point HomeMotion::place(Index dof, const Point& wanted) const {
    const Index v = problem_.dof_vertex()[dof];
    if (surface_.associations()[v].kind == EntityKind::interior || hold_[v] != Hold::home) return wanted;
    return project(dof, wanted).point;
}

LimitTerm HomeMotion::limit(Index dof, const Point& at) const {
    const Index v = problem_.dof_vertex()[dof];
    const bool anchored = hold_[v] == Hold::anchored;
    const EntityKind kind = anchored ? EntityKind::corner : surface_.associations()[v].kind;
    const Projection foot = anchored ? Projection{anchor_[v]} : project(dof, at);
    const Point offset = at - foot.point;
    LimitTerm term;
    term.energy = stiffness_[dof] * glm::dot(offset, offset);
    term.gradient = 2 * stiffness_[dof] * offset;
    glm::dmat3 across(1);
    const Point& n = foot.direction;
    if (kind == EntityKind::patch) across = glm::outerProduct(n, n);
    if (kind == EntityKind::curve) across -= glm::outerProduct(n, n);
    term.hessian = 2 * stiffness_[dof] * across;
    return term;
}

} // namespace hexopt
