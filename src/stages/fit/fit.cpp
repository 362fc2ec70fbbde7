#include "stages/fit/fit.hpp"

#include "mesh/topology.hpp"
#include "stages/fit/regions.hpp"
#include "stages/fit/spread_path.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <memory>

namespace hexopt {

namespace {

using namespace fit;

constexpr std::size_t kChunk = 512;
constexpr double kSurelySharp_deg = 50;

class Fitter {
  public:
    Fitter(HexMesh mesh, const Domain& domain, const FitOptions& options, Context& context)
        : domain_(domain), options_(options), context_(context),
          topology_(compute_topology(mesh, context.parallel())), surface_(extract_surface(mesh, topology_)) {
        output_.fitted.mesh = std::move(mesh);
    }

    Result<FitOutput> run() {
        placed_ = fair_and_project(output_.fitted.mesh, surface_, domain_, options_.fairing, context_);
        if (context_.is_cancelled()) return cancelled();
        find_features();
        if (context_.is_cancelled()) return cancelled();
        regions_ = find_regions(surface_, placed_, domain_, net_, capture_, context_);
        associate();
        place_features();
        smooth_patches();
        write_back();
        report();
        find_cells_to_refine();
        return std::move(output_);
    }

  private:
    static Error cancelled() { return make_error(ErrorCode::cancelled, "fit", "", "cancelled"); }

    void find_features() {
        std::vector<Point> places;
        for (Index k = 0; k < domain_.model.corner_count(); ++k)
            places.push_back(domain_.model.corner_point(k));
        tree_ = std::make_unique<VertexTree>(surface_, placed_, places);
        std::vector<double> cell_size;
        for (const Point& p : places) {
            const Index v = tree_->nearest(p);
            cell_size.push_back(v == kNoIndex ? 0 : surface_.size[v]);
        }
        std::vector<Point> unfitted;
        for (Index v : surface_.vertex) unfitted.push_back(output_.fitted.mesh.positions[v]);
        std::vector<Index> as_points;
        do {
            net_ = make_curve_net(domain_, find_small_features(domain_, cell_size, as_points));
            capture_ = capture_features(surface_, unfitted, placed_, *tree_, domain_, net_, options_.capture,
                                        context_);
        } while (give_up_ends(as_points));
        capture_pieces(surface_, placed_, *tree_, domain_, net_, capture_, context_);
    }

    /// Short curves that no single edge follows become points after all; true if there were any.
    bool give_up_ends(std::vector<Index>& as_points) const {
        const std::size_t before = as_points.size();
        for (Index l = 0; l < net_.legs.size(); ++l)
            if (net_.one_edge[l] && capture_.path[l].size() != 2) as_points.push_back(net_.legs[l].curve);
        std::sort(as_points.begin(), as_points.end());
        return as_points.size() > before;
    }

    void associate() {
        bound_.assign(surface_.vertex.size(), {});
        for (Index v = 0; v < surface_.vertex.size(); ++v) {
            if (surface_.hanging[v]) {
                bound_[v] = {EntityKind::hanging, kNoIndex};
                continue;
            }
            Index patch = kNoIndex;
            bool same = true;
            for (Index q : surface_.vertex_quad[v]) {
                if (patch != kNoIndex && regions_.quad_patch[q] != patch) same = false;
                patch = regions_.quad_patch[q];
            }
            if (!same) {
                const Projection at = domain_.model.project_patch(kNoIndex, placed_[v]);
                patch = domain_.model.patch_of_triangle(at.element);
            }
            bound_[v] = {EntityKind::patch, patch};
        }
        for (Index e = 0; e < surface_.edge.size(); ++e) {
            if (regions_.edge_curve[e] == kNoIndex) continue;
            bound_[surface_.edge[e].a] =
                bound_[surface_.edge[e].b] = {EntityKind::curve, regions_.edge_curve[e]};
        }
        for (Index a = 0; a < net_.anchors.size(); ++a) {
            const Index v = capture_.anchor_vertex[a], corner = net_.anchors[a].corner;
            if (v != kNoIndex && corner != kNoIndex && is_on_ridge(v))
                bound_[v] = {EntityKind::corner, corner};
        }
    }

    bool is_on_ridge(Index v) const {
        const std::span<const Index> edges = surface_.vertex_edge[v];
        return std::any_of(edges.begin(), edges.end(),
                           [&](Index e) { return regions_.edge_curve[e] != kNoIndex; });
    }

    void place_features() {
        target_ = placed_;
        followed_.resize(net_.legs.size());
        for (Index l = 0; l < net_.legs.size(); ++l)
            if (!capture_.path[l].empty()) place_path(l, capture_.path[l], {0, net_.legs[l].length()});
        for (const Piece& piece : capture_.pieces)
            place_path(piece.leg, piece.path, {arc_of_end(piece, 0), arc_of_end(piece, 1)});
    }

    /// Arc length at an end of a piece: an anchor's, or the closest point's.
    double arc_of_end(const Piece& piece, int end) const {
        const Leg& leg = net_.legs[piece.leg];
        const Index v = end == 0 ? piece.path.front() : piece.path.back();
        if (v == capture_.anchor_vertex[leg.anchor[end]]) return end == 0 ? 0 : leg.length();
        return closest_arc_length(leg, placed_[v]);
    }

    void place_path(Index l, const std::vector<Index>& path, std::array<double, 2> ends) {
        const Leg& leg = net_.legs[l];
        const std::vector<double> arc = spread_path(leg, ends, path, surface_, placed_);
        for (std::size_t i = 0; i < path.size(); ++i) {
            const EntityKind kind = bound_[path[i]].kind;
            if (kind == EntityKind::curve || kind == EntityKind::corner)
                target_[path[i]] = point_at(leg, arc[i]);
        }
        for (std::size_t i = 0; i + 1 < path.size(); ++i)
            if (regions_.edge_curve[find_edge(surface_, path[i], path[i + 1])] == leg.curve)
                followed_[l].push_back({arc[i], arc[i + 1]});
    }

    void smooth_patches() {
        std::vector<Index> hint(target_.size(), kNoIndex);
        for (int sweep = 0; sweep < options_.surface_sweeps; ++sweep) {
            std::vector<Point> moved = target_;
            context_.parallel().for_each(moved.size(), kChunk, [&](std::size_t i) {
                const auto v = static_cast<Index>(i);
                if (bound_[v].kind != EntityKind::patch) return;
                Point sum(0);
                for (Index e : surface_.vertex_edge[v]) sum += target_[surface_.other_end(e, v)];
                const Point mean = sum / static_cast<double>(surface_.vertex_edge[v].size());
                const Projection at = domain_.model.project(bound_[v], 0.5 * (mean + target_[v]), hint[v]);
                hint[v] = at.element;
                moved[v] = at.point;
            });
            target_.swap(moved);
            place_hanging(output_.fitted.mesh, surface_, target_);
        }
    }

    void write_back() {
        HexMesh& mesh = output_.fitted.mesh;
        output_.fitted.association.assign(mesh.vertex_count(), {});
        output_.fitted.unfitted = mesh.positions;
        for (std::size_t r = 0; r < mesh.hanging.count(); ++r)
            output_.fitted.association[mesh.hanging.vertex[r]] = {EntityKind::hanging, kNoIndex};
        for (Index v = 0; v < surface_.vertex.size(); ++v) {
            output_.fitted.association[surface_.vertex[v]] = bound_[v];
            output_.report.largest_distance =
                std::max(output_.report.largest_distance,
                         glm::distance(target_[v], mesh.positions[surface_.vertex[v]]));
            mesh.positions[surface_.vertex[v]] = target_[v];
        }
        mesh.boundary.clear();
        mesh.patch_names.clear();
        for (Index name : domain_.patch_name) mesh.patch_names.push_back(domain_.names[name]);
        for (Index q = 0; q < surface_.quad.size(); ++q) {
            Quad quad = surface_.quad[q];
            for (Index& v : quad) v = surface_.vertex[v];
            mesh.boundary.push_back({quad, regions_.quad_patch[q]});
        }
        for (Index e = 0; e < surface_.edge.size(); ++e)
            if (regions_.edge_curve[e] != kNoIndex)
                output_.fitted.ridges.push_back({surface_.vertex[surface_.edge[e].a],
                                                 surface_.vertex[surface_.edge[e].b],
                                                 regions_.edge_curve[e]});
        std::sort(output_.fitted.ridges.begin(), output_.fitted.ridges.end());
    }

    void report() {
        FitReport& report = output_.report;
        report.corners = domain_.model.corner_count();
        report.curves = domain_.model.curve_count();
        report.reroutes = capture_.reroutes;
        for (Index l = 0; l < net_.legs.size(); ++l)
            for (const auto& [from, to] : followed_[l]) report.followed_length += to - from;
        for (Index c = 0; c < report.curves; ++c) {
            const std::span<const Point> points = domain_.model.curve_points(c);
            for (std::size_t i = 1; i < points.size(); ++i)
                report.curve_length += glm::distance(points[i - 1], points[i]);
        }
        for (const Association& a : bound_) report.captured_corners += a.kind == EntityKind::corner;
        for (Index c = 0; c < report.curves; ++c)
            if (regions_.kept(c))
                ++report.captured_curves;
            else
                report.released_curves.push_back({c, regions_.released[c]});
    }

    /// Cells with a boundary vertex within two edge lengths of a released curve, where no edges follow it.
    void find_cells_to_refine() {
        std::vector<std::uint8_t> near(surface_.vertex.size(), 0);
        for (const FitReport::ReleasedCurve& released : output_.report.released_curves) {
            if (released.reason == Release::open) continue;
            if (released.reason == Release::small) mark_small_curve(released.curve, near);
            const auto [first, last] = net_.curve_legs[released.curve];
            for (Index l = first; l < last; ++l) mark_lost_parts(l, near);
        }
        std::vector<Index>& cells = output_.refine_cells;
        for (std::size_t f = 0; f < topology_.boundary_faces.size(); ++f)
            for (Index v : surface_.quad[f])
                if (near[v]) cells.push_back(topology_.boundary_faces[f].cell);
        std::sort(cells.begin(), cells.end());
        cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    }

    /// Asks for finer cells at a small curve that is sharp enough not to be noise of a tessellation.
    void mark_small_curve(Index c, std::vector<std::uint8_t>& near) const {
        const CurveAngle& angle = domain_.angle[c];
        if (std::max(180 - angle.smallest, angle.largest - 180) < kSurelySharp_deg) return;
        const std::span<const Point> points = domain_.model.curve_points(c);
        for (const Point& place : {points.front(), points.back()}) {
            const Index v = tree_->nearest(place);
            tree_->visit_within(place, 2 * surface_.size[v], [&](Index u, double) { near[u] = 1; });
        }
    }

    void mark_lost_parts(Index l, std::vector<std::uint8_t>& near) const {
        const Leg& leg = net_.legs[l];
        const auto is_followed = [&](double s) {
            return std::any_of(followed_[l].begin(), followed_[l].end(),
                               [&](const auto& part) { return part[0] <= s && s <= part[1]; });
        };
        for (double s = 0, step = leg.length(); s <= leg.length(); s += step) {
            const Point place = point_at(leg, s);
            const Index v = tree_->nearest(place);
            if (v == kNoIndex) return;
            step = std::max(0.5 * surface_.size[v], leg.length() / 1000);
            if (is_followed(s)) continue;
            tree_->visit_within(place, 2 * surface_.size[v], [&](Index u, double) { near[u] = 1; });
        }
    }

    const Domain& domain_;
    const FitOptions& options_;
    Context& context_;
    Topology topology_;
    SurfaceMesh surface_;
    std::unique_ptr<VertexTree> tree_; ///< of placed_
    CurveNet net_;
    Capture capture_;
    Regions regions_;
    std::vector<Point> placed_, target_;
    std::vector<Association> bound_;
    std::vector<std::vector<std::array<double, 2>>> followed_; ///< per leg: arc lengths that edges follow
    FitOutput output_;
};

} // namespace

Result<FitOutput> fit_boundary(HexMesh trimmed, const Domain& domain, const FitOptions& options,
                               Context& context) {
    return Fitter(std::move(trimmed), domain, options, context).run();
}

} // namespace hexopt
