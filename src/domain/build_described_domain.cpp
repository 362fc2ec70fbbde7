#include "core/union_find.hpp"
#include "domain/boundary_model_builder.hpp"
#include "domain/closest_point.hpp"
#include "domain/domain.hpp"
#include "domain/domain_parts.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numeric>

namespace hexopt {

namespace {

using Description = DomainDescription;
constexpr double kFit_rel = 1e-6;     ///< within it what belongs together is at one place
constexpr double kOnCurve_rel = 1e-4; ///< within it a new corner lies on a curve, a curve on a border

struct LessPoint {
    bool operator()(const Point& a, const Point& b) const {
        for (int k = 0; k < 3; ++k)
            if (a[k] != b[k]) return a[k] < b[k];
        return false;
    }
};

std::string at_place(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

/// Entities by rising number.
template <class T>
std::vector<const T*> in_order(const std::vector<T>& entities) {
    std::vector<const T*> order;
    for (const T& entity : entities) order.push_back(&entity);
    std::stable_sort(order.begin(), order.end(),
                     [](const T* a, const T* b) { return a->number < b->number; });
    return order;
}

class DescribedDomain {
  public:
    DescribedDomain(const Description& given, Context& context) : given_(given), context_(context) {}

    Status build(Domain& domain);

  private:
    struct Curve {
        const Description::Curve* given;
        std::vector<Index> chain;                         ///< vertices; a loop repeats its first
        std::array<Index, 2> ends = {kNoIndex, kNoIndex}; ///< corners
        std::vector<Index> patches;                       ///< beside it, before joining
    };
    using EdgePatches = std::map<std::array<Index, 2>, std::vector<Index>>;

    Error refuse(const Description::Entity& entity, std::string reason, std::string advice) const {
        const std::string where =
            entity.line > 0 ? fmt::format("{}:{}", given_.file, entity.line) : given_.file;
        return Error{ErrorCode::bad_input, "domain", where, {std::move(reason), std::move(advice)}};
    }
    void warn(const Description::Entity& entity, const std::string& what) const {
        context_.log(LogLevel::warning, fmt::format("{}:{}: {}", given_.file, entity.line, what));
    }

    Status gather_triangles();
    void number_vertices();
    Index vertex_at(const Point& p);
    Status gather_corners();
    Status gather_curves();
    Status append_polyline(const Description::Curve& curve, const Description::Polyline& polyline,
                           bool is_first, const Description::Polyline* next, std::vector<Index>& chain);
    Status place_ends(Curve& curve);
    void add_new_corners();
    bool cut_nearest_curve(const Point& p, Index corner);
    EdgePatches find_bare_borders() const;
    void join_patches();
    void assemble(Domain& domain);
    Status check_lone_corners(const Domain& domain) const;

    Point position(Index v) const { return surface_.vertices[v]; }
    double distance(Index v, const Point& p) const { return glm::distance(position(v), p); }
    bool is_near(Index a, const Point& p) const { return distance(a, p) <= kFit_rel * diagonal_; }

    const Description& given_;
    Context& context_;
    std::vector<const Description::Patch*> patches_; ///< by rising number
    std::vector<std::string> names_;
    std::vector<Index> source_name_; ///< per triangle of the soup
    CleanSurface surface_;           ///< its vertices are followed by those of curves and corners alone
    double diagonal_ = 0;
    std::map<Point, Index, LessPoint> vertex_; ///< those that curves and corners ask for
    std::vector<const Description::Corner*> corners_;
    std::vector<Index> corner_vertex_;
    std::vector<std::uint8_t> corner_used_;
    std::vector<Curve> curves_;
    std::vector<Index> joined_; ///< per patch: the patch of the domain
};

template <class Entity>
std::map<std::int64_t, const Entity*> by_number(const std::vector<Entity>& entities) {
    std::map<std::int64_t, const Entity*> map;
    for (const Entity& entity : entities) map.emplace(entity.number, &entity);
    return map;
}

Status DescribedDomain::gather_triangles() {
    patches_ = in_order(given_.patches);
    const auto surfaces = by_number(given_.surfaces);
    names_ = given_.names;
    TriangleSoup soup;
    std::map<std::int64_t, std::int64_t> used; // surface: its patch
    for (Index p = 0; p < patches_.size(); ++p) {
        const Description::Patch& patch = *patches_[p];
        const auto name = std::find(names_.begin(), names_.end(), patch.name);
        const auto name_number = static_cast<Index>(name - names_.begin());
        if (name == names_.end()) names_.push_back(patch.name);
        for (std::int64_t number : patch.surfaces) {
            const auto found = surfaces.find(number);
            if (found == surfaces.end())
                return refuse(
                    patch,
                    fmt::format("patch {} leans on surface {}, which is not there", patch.number, number),
                    "name one of the surfaces under 'geometry'");
            if (const auto [first, is_new] = used.emplace(number, patch.number); !is_new)
                return refuse(patch,
                              fmt::format("surface {} carries patch {} already", number, first->second),
                              "a surface belongs to one patch");
            const auto offset = static_cast<Index>(soup.vertices.size());
            const Description::Surface& surface = *found->second;
            soup.vertices.insert(soup.vertices.end(), surface.points.begin(), surface.points.end());
            for (const auto& [a, b, c] : surface.triangles) {
                soup.triangles.push_back({offset + a, offset + b, offset + c});
                soup.patch.push_back(p);
                source_name_.push_back(name_number);
            }
        }
    }
    for (const Description::Surface& surface : given_.surfaces)
        if (!used.contains(surface.number))
            warn(surface, fmt::format("surface {} carries no patch and is left out", surface.number));
    Result<CleanSurface> clean = clean_surface(soup);
    if (!clean) {
        Error error = clean.error();
        error.where = given_.file;
        return error;
    }
    surface_ = std::move(*clean);
    std::vector<std::uint8_t> has_triangles(patches_.size(), 0);
    for (Index p : surface_.polygons.patch) has_triangles[p] = 1;
    for (Index p = 0; p < patches_.size(); ++p)
        if (!has_triangles[p])
            return refuse(*patches_[p], fmt::format("patch {} has no triangles", patches_[p]->number),
                          "delete it, or give it a surface with triangles");
    return Done{};
}

/// The surface's vertices at the places of curves and corners.
void DescribedDomain::number_vertices() {
    for (const auto& polyline : given_.polylines)
        for (const Point& p : polyline.points) vertex_.emplace(p, kNoIndex);
    for (const auto& corner : given_.corners) vertex_.emplace(corner.position, kNoIndex);
    Box box;
    for (const auto& triangle : surface_.triangles)
        for (Index v : triangle) {
            box.add(position(v));
            if (const auto found = vertex_.find(position(v)); found != vertex_.end()) found->second = v;
        }
    diagonal_ = glm::distance(box.low, box.high);
}

Index DescribedDomain::vertex_at(const Point& p) {
    const auto found = vertex_.emplace(p, kNoIndex).first;
    if (found->second == kNoIndex) {
        found->second = static_cast<Index>(surface_.vertices.size());
        surface_.vertices.push_back(p);
    }
    return found->second;
}

Status DescribedDomain::gather_corners() {
    corners_ = in_order(given_.corners);
    corner_used_.assign(corners_.size(), 0);
    std::map<Index, const Description::Corner*> at;
    for (const Description::Corner* corner : corners_) {
        corner_vertex_.push_back(vertex_at(corner->position));
        if (const auto [first, is_new] = at.emplace(corner_vertex_.back(), corner); !is_new)
            return refuse(
                *corner,
                fmt::format("corner {} is where corner {} is", corner->number, first->second->number),
                "delete one of them");
    }
    return Done{};
}

/// Appends the vertices of a polyline, turned so that it goes on from the last one or leads to the next one.
Status DescribedDomain::append_polyline(const Description::Curve& curve,
                                        const Description::Polyline& polyline, bool is_first,
                                        const Description::Polyline* next, std::vector<Index>& chain) {
    std::vector<Index> ids;
    for (const Point& p : polyline.points)
        if (const Index v = vertex_at(p); ids.empty() || ids.back() != v) ids.push_back(v);
    const auto meets_next = [&](Index v) {
        return next && (is_near(v, next->points.front()) || is_near(v, next->points.back()));
    };
    const bool turn = is_first ? meets_next(ids.front()) && !meets_next(ids.back())
                               : !is_near(ids.front(), position(chain.back()));
    if (turn) std::reverse(ids.begin(), ids.end());
    if (!is_first && !is_near(ids.front(), position(chain.back())))
        return refuse(
            curve,
            fmt::format("polyline {} of curve {} does not begin where the one before it ends, at {}",
                        polyline.number, curve.number, at_place(position(chain.back()))),
            "list the polylines in the order in which they meet");
    chain.insert(chain.end(), ids.begin() + (is_first ? 0 : 1), ids.end());
    return Done{};
}

/// Puts corners at the ends of a curve's chain, or closes it.
Status DescribedDomain::place_ends(Curve& curve) {
    const Description::Curve& given = *curve.given;
    std::vector<Index>& chain = curve.chain;
    if (!given.ends) {
        if (!is_near(chain.front(), position(chain.back())))
            return refuse(given,
                          fmt::format("curve {} is not closed: it runs from {} to {}", given.number,
                                      at_place(position(chain.front())), at_place(position(chain.back()))),
                          "give its corners with 'from N to N'");
        chain.back() = chain.front();
    } else {
        for (std::size_t i = 0; i < 2; ++i) {
            const auto found =
                std::find_if(corners_.begin(), corners_.end(),
                             [&](const Description::Corner* c) { return c->number == (*given.ends)[i]; });
            if (found == corners_.end())
                return refuse(given,
                              fmt::format("curve {} ends in corner {}, which is not there", given.number,
                                          (*given.ends)[i]),
                              "name a corner, or join the two curves that met there");
            curve.ends[i] = static_cast<Index>(found - corners_.begin());
            corner_used_[curve.ends[i]] = 1;
        }
        const Point from = corners_[curve.ends[0]]->position, to = corners_[curve.ends[1]]->position;
        if (!is_near(chain.front(), from) && is_near(chain.back(), from))
            std::reverse(chain.begin(), chain.end());
        for (std::size_t i = 0; i < 2; ++i) {
            Index& end = i == 0 ? chain.front() : chain.back();
            if (!is_near(end, i == 0 ? from : to))
                return refuse(given,
                              fmt::format("curve {} ends at {}, {:.3g} from corner {}", given.number,
                                          at_place(position(end)), distance(end, i == 0 ? from : to),
                                          (*given.ends)[i]),
                              "give the corners at its ends");
            end = corner_vertex_[curve.ends[i]];
        }
    }
    const std::size_t least = chain.front() == chain.back() ? 4 : 2;
    if (chain.size() < least)
        return refuse(given, fmt::format("curve {} has {} points, too few", given.number, chain.size()),
                      "give it a longer polyline");
    return Done{};
}

Status DescribedDomain::gather_curves() {
    const auto polylines = by_number(given_.polylines);
    std::map<std::int64_t, Index> patch_of;
    for (Index p = 0; p < patches_.size(); ++p) patch_of.emplace(patches_[p]->number, p);
    for (const Description::Curve* given : in_order(given_.curves)) {
        Curve curve;
        curve.given = given;
        std::vector<const Description::Polyline*> parts;
        for (std::int64_t number : given->polylines) {
            const auto found = polylines.find(number);
            if (found == polylines.end())
                return refuse(
                    *given,
                    fmt::format("curve {} leans on polyline {}, which is not there", given->number, number),
                    "name one of the polylines under 'geometry'");
            parts.push_back(found->second);
        }
        for (std::size_t i = 0; i < parts.size(); ++i)
            if (Status ok = append_polyline(*given, *parts[i], i == 0,
                                            i + 1 < parts.size() ? parts[i + 1] : nullptr, curve.chain);
                !ok)
                return ok;
        for (std::int64_t number : given->patches) {
            const auto found = patch_of.find(number);
            if (found == patch_of.end())
                return refuse(
                    *given,
                    fmt::format("curve {} lies between patch {}, which is not there", given->number, number),
                    "name the patches beside it after 'between'");
            curve.patches.push_back(found->second);
        }
        if (Status ok = place_ends(curve); !ok) return ok;
        curves_.push_back(std::move(curve));
    }
    return Done{};
}

/// Cuts the nearest curve at p, if one is near enough; `corner` is the new end.
bool DescribedDomain::cut_nearest_curve(const Point& p, Index corner) {
    double best = kOnCurve_rel * diagonal_;
    std::size_t at_curve = curves_.size(), at_segment = 0;
    Point nearest = p;
    for (std::size_t c = 0; c < curves_.size(); ++c)
        for (std::size_t i = 0; i + 1 < curves_[c].chain.size(); ++i) {
            const Point q =
                closest_on_segment(p, position(curves_[c].chain[i]), position(curves_[c].chain[i + 1])).point;
            if (glm::distance(p, q) > best) continue;
            if (at_curve < curves_.size() && glm::distance(p, q) == best) continue;
            best = glm::distance(p, q);
            at_curve = c;
            at_segment = i;
            nearest = q;
        }
    if (at_curve == curves_.size()) return false;
    Curve& curve = curves_[at_curve];
    std::size_t at = at_segment;
    if (is_near(curve.chain[at + 1], nearest)) ++at;
    if (!is_near(curve.chain[at], nearest))
        curve.chain.insert(curve.chain.begin() + static_cast<std::ptrdiff_t>(++at), vertex_at(nearest));
    const Index vertex = curve.chain[at];
    corner_vertex_[corner] = vertex;
    if (curve.ends[0] == kNoIndex) { // a loop begins at its new corner
        curve.chain.pop_back();
        at %= curve.chain.size();
        std::rotate(curve.chain.begin(), curve.chain.begin() + static_cast<std::ptrdiff_t>(at),
                    curve.chain.end());
        curve.chain.push_back(vertex);
        curve.ends = {corner, corner};
        return true;
    }
    if (at == 0 || at + 1 == curve.chain.size()) return false; // where a corner is already
    Curve rest = curve;
    rest.chain.erase(rest.chain.begin(), rest.chain.begin() + static_cast<std::ptrdiff_t>(at));
    curve.chain.resize(at + 1);
    rest.ends[0] = curve.ends[1] = corner;
    curves_.push_back(std::move(rest));
    return true;
}

/// Corners that end no curve cut one; those that lie on none are left out.
void DescribedDomain::add_new_corners() {
    for (Index c = 0; c < corners_.size(); ++c) {
        if (corner_used_[c] || corners_[c]->alone) continue;
        if (cut_nearest_curve(corners_[c]->position, c)) {
            corner_used_[c] = 1;
            continue;
        }
        warn(*corners_[c],
             fmt::format("corner {} ends no curve and lies on none: left out; write 'alone' behind it "
                         "to keep it",
                         corners_[c]->number));
    }
    std::vector<Index> number(corners_.size(), kNoIndex);
    std::size_t kept = 0;
    for (Index c = 0; c < corners_.size(); ++c) {
        if (!corner_used_[c] && !corners_[c]->alone) continue;
        number[c] = static_cast<Index>(kept);
        corners_[kept] = corners_[c];
        corner_vertex_[kept++] = corner_vertex_[c];
    }
    corners_.resize(kept);
    corner_vertex_.resize(kept);
    for (Curve& curve : curves_)
        for (Index& end : curve.ends)
            if (end != kNoIndex) end = number[end];
}

/// Edges between triangles of different patches that are no edges of curves.
DescribedDomain::EdgePatches DescribedDomain::find_bare_borders() const {
    struct Side {
        std::array<Index, 2> edge;
        Index patch;
    };
    std::vector<Side> sides;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [low, high] =
                std::minmax(surface_.triangles[t][k], surface_.triangles[t][(k + 1) % 3]);
            sides.push_back({{low, high}, surface_.polygons.patch[t]});
        }
    std::stable_sort(sides.begin(), sides.end(),
                     [](const Side& a, const Side& b) { return a.edge < b.edge; });
    EdgePatches borders;
    for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
        for (end = i + 1; end < sides.size() && sides[end].edge == sides[i].edge;) ++end;
        std::vector<Index> patches;
        for (std::size_t s = i; s < end; ++s) patches.push_back(sides[s].patch);
        std::sort(patches.begin(), patches.end());
        patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
        if (patches.size() > 1) borders.emplace(sides[i].edge, std::move(patches));
    }
    for (const Curve& curve : curves_)
        for (std::size_t i = 0; i + 1 < curve.chain.size(); ++i) {
            const auto [low, high] = std::minmax(curve.chain[i], curve.chain[i + 1]);
            borders.erase({low, high});
        }
    return borders;
}

/// Patches that meet where no curve is become one.
void DescribedDomain::join_patches() {
    UnionFind sets(patches_.size());
    for (const auto& [edge, patches] : find_bare_borders()) {
        const Point middle = 0.5 * (position(edge[0]) + position(edge[1]));
        const auto holds = [&](const Curve& curve, Index patch) {
            return std::find(curve.patches.begin(), curve.patches.end(), patch) != curve.patches.end();
        };
        for (std::size_t i = 1; i < patches.size(); ++i) {
            bool is_covered = false;
            for (const Curve& curve : curves_) {
                if (is_covered || !holds(curve, patches[0]) || !holds(curve, patches[i])) continue;
                for (std::size_t k = 0; k + 1 < curve.chain.size() && !is_covered; ++k) {
                    const Point q =
                        closest_on_segment(middle, position(curve.chain[k]), position(curve.chain[k + 1]))
                            .point;
                    is_covered = glm::distance(middle, q) <= kOnCurve_rel * diagonal_;
                }
            }
            if (!is_covered) sets.join(patches[0], patches[i]);
        }
    }
    std::vector<Index> number(patches_.size(), kNoIndex);
    Index count = 0;
    for (Index p = 0; p < patches_.size(); ++p) {
        const Index root = sets.find(p);
        if (number[root] == kNoIndex) number[root] = count++;
        joined_.push_back(number[root]);
    }
}

void DescribedDomain::assemble(Domain& domain) {
    FeatureGraph graph;
    BoundaryModelParts parts;
    for (Index p : surface_.polygons.patch) graph.face_patch.push_back(joined_[p]);
    parts.patch = graph.face_patch;
    parts.patch_count = graph.patch_count = *std::max_element(joined_.begin(), joined_.end()) + 1;
    for (const Curve& curve : curves_) {
        graph.curve_vertex.item.insert(graph.curve_vertex.item.end(), curve.chain.begin(), curve.chain.end());
        graph.curve_vertex.offset.push_back(graph.curve_vertex.item.size());
        parts.curve_ends.push_back(curve.ends);
    }
    parts.curve_vertex = graph.curve_vertex;
    parts.corner_vertex = corner_vertex_;
    parts.vertices = surface_.vertices;
    parts.triangles = surface_.triangles;
    parts.source = surface_.source;
    domain.model = BoundaryModelBuilder::assemble(std::move(parts));
    add_incidence(graph, surface_, domain);
    const Csr<Index> beside = std::move(domain.curve_patch);
    domain.curve_patch = {};
    for (std::size_t c = 0; c < curves_.size(); ++c) {
        const Description::Curve& given = *curves_[c].given;
        std::vector<Index> patches;
        for (Index p : curves_[c].patches) patches.push_back(joined_[p]);
        if (patches.empty()) patches.assign(beside[c].begin(), beside[c].end());
        std::sort(patches.begin(), patches.end());
        patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
        domain.curve_patch.item.insert(domain.curve_patch.item.end(), patches.begin(), patches.end());
        domain.curve_patch.offset.push_back(domain.curve_patch.item.size());
        domain.curve_open[c] = given.open;
        if (given.angle_deg) domain.angle[c] = {given.angle_deg->front(), given.angle_deg->back()};
    }
    domain.names = names_;
    add_names(source_name_, domain);
    // Of several names in one patch the borders are no features.
    for (Index name = 0; name < domain.names.size(); ++name)
        domain.name_group.push_back(domain.triangle_name.empty() ? name : 0);
    domain.dropped_triangles = surface_.dropped_triangles;
    domain.open_edges = surface_.open_edges;
    domain.nonmanifold_edges = surface_.nonmanifold_edges;
}

Status DescribedDomain::check_lone_corners(const Domain& domain) const {
    for (std::size_t c = 0; c < corners_.size(); ++c) {
        const double away = domain.model.distance(position(corner_vertex_[c]));
        if (away > kOnCurve_rel * diagonal_)
            return refuse(*corners_[c],
                          fmt::format("corner {} is {:.3g} away from the surface", corners_[c]->number, away),
                          "move it onto the surface");
    }
    return Done{};
}

Status DescribedDomain::build(Domain& domain) {
    if (given_.patches.empty()) return refuse({}, "there are no patches", "give at least one");
    if (Status ok = gather_triangles(); !ok) return ok;
    number_vertices();
    if (Status ok = gather_corners(); !ok) return ok;
    if (Status ok = gather_curves(); !ok) return ok;
    add_new_corners();
    if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "domain", "", "cancelled");
    join_patches();
    assemble(domain);
    return check_lone_corners(domain);
}

} // namespace

Result<Domain> build_domain(const DomainDescription& description, Context& context) {
    Domain domain;
    if (Status ok = DescribedDomain(description, context).build(domain); !ok) return ok.error();
    return domain;
}

} // namespace hexopt
