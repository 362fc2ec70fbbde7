#include "stages/refine/region_surface.hpp"

#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kWeld_rel = 1e-4;

double distance(const Box& box, const Point& x) {
    return glm::length(glm::max(glm::max(box.low - x, x - box.high), Point(0)));
}

} // namespace

RegionSurface::RegionSurface(Domain domain) : domain_(std::move(domain)), queries_(domain_.model) {
    for (Index t = 0; t < domain_.model.triangle_count(); ++t)
        for (const Point& p : domain_.model.triangle(t)) box_.add(p);
}

Result<std::shared_ptr<const RegionSurface>> RegionSurface::create(const TriangleSoup& soup,
                                                                   Context& context) {
    Box box;
    for (const Point& p : soup.vertices) box.add(p);
    const double diagonal = soup.vertices.empty() ? 0 : glm::distance(box.low, box.high);
    auto welded = weld_surface(soup, kWeld_rel * diagonal, context);
    if (!welded) return welded.error();
    auto oriented = orient_surface(welded->soup, context);
    if (!oriented) return oriented.error();
    auto domain = build_domain(oriented->soup, {}, context);
    if (!domain) return domain.error();
    return std::shared_ptr<const RegionSurface>(new RegionSurface(std::move(*domain)));
}

bool RegionSurface::is_near(const Point& at, double reach) const {
    return distance(box_, at) <= reach && domain_.model.distance(at) <= reach;
}

bool RegionSurface::is_inside(const Point& at) const {
    return distance(box_, at) <= 0 && queries_.is_inside(at);
}

} // namespace hexopt
