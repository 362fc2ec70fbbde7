#include "stages/planar/wall_row.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Of the way to the next link: where the neighbours of a corner with one cell start.
constexpr double kBeside = 1.0 / 3;

class RowBuilder {
  public:
    RowBuilder(const KeptLoop& loop, const std::vector<WallLink>& links, const OutlineCurves& curves,
               QuadMesh& mesh, WallRowReport& report)
        : loop_(loop), links_(links), curves_(curves), mesh_(mesh), report_(report) {}

    void run() {
        const std::size_t n = links_.size();
        for (std::size_t i = 0; i < n; ++i) make_vertices(i);
        for (std::size_t i = 0; i < n; ++i) {
            add_corner_quads(i);
            const WallLink &link = links_[i], &next = links_[(i + 1) % n];
            const Index from = link.position + link.span();
            add_quad({kept(next.position), kept(from), out_[i], in_[(i + 1) % n]}, from);
            add_wall(out_[i], in_[(i + 1) % n]);
        }
    }

  private:
    Index kept(Index position) const { return loop_.vertices[position % loop_.vertices.size()]; }

    /// Length along the outline to the next link.
    double gap_after(std::size_t i) const {
        const double length = curves_.length(loop_.outline);
        const double gap = links_[(i + 1) % links_.size()].s - links_[i].s;
        return gap - std::floor(gap / length) * length;
    }

    Index make_vertex(double s, Index corner) {
        const auto v = static_cast<Index>(mesh_.positions.size());
        const bool is_corner = corner != kNoIndex;
        mesh_.positions.push_back(is_corner ? curves_.corners(loop_.outline)[corner].point
                                            : curves_.point(loop_.outline, s));
        mesh_.place.push_back({loop_.outline, s, is_corner});
        return v;
    }

    void make_vertices(std::size_t i) {
        const WallLink& link = links_[i];
        if (link.cells != 1) {
            in_.push_back(make_vertex(link.s, link.corner));
            out_.push_back(in_.back());
            tip_.push_back(in_.back());
        } else {
            const double before = gap_after((i + links_.size() - 1) % links_.size());
            in_.push_back(make_vertex(link.s - kBeside * before, kNoIndex));
            tip_.push_back(make_vertex(link.s, link.corner));
            out_.push_back(make_vertex(link.s + kBeside * gap_after(i), kNoIndex));
        }
        if (link.corner != kNoIndex && curves_.corners(loop_.outline)[link.corner].is_sharp)
            ++report_.corners[static_cast<std::size_t>(link.cells)];
    }

    /// position: of the kept edge beside it.
    void add_quad(const Quad& quad, Index position) {
        const Index beside = loop_.quads[position % loop_.quads.size()];
        mesh_.quads.push_back(quad);
        mesh_.level.push_back(mesh_.level[beside]);
        mesh_.size.push_back(mesh_.size[beside]);
        mesh_.cell.push_back(mesh_.cell[beside]);
        ++report_.cells;
    }

    void add_wall(Index a, Index b) {
        const double length = curves_.length(loop_.outline), s = mesh_.place[a].s;
        double gap = mesh_.place[b].s - s;
        gap -= std::floor(gap / length) * length;
        mesh_.wall.push_back({a, b, curves_.patch(loop_.outline, s + gap / 2)});
    }

    void add_corner_quads(std::size_t i) {
        const WallLink& link = links_[i];
        if (link.cells == 1) {
            add_quad({kept(link.position), in_[i], tip_[i], out_[i]}, link.position);
            add_wall(in_[i], tip_[i]);
            add_wall(tip_[i], out_[i]);
        }
        for (Index k = 0; k < link.span(); k += 2)
            add_quad(
                {kept(link.position + k + 2), kept(link.position + k + 1), kept(link.position + k), tip_[i]},
                link.position + k);
    }

    const KeptLoop& loop_;
    const std::vector<WallLink>& links_;
    const OutlineCurves& curves_;
    QuadMesh& mesh_;
    WallRowReport& report_;
    std::vector<Index> in_, tip_, out_; ///< per link: first, middle and last vertex on the outline
};

} // namespace

void add_wall_row(const KeptLoop& loop, const std::vector<WallLink>& links, const OutlineCurves& curves,
                  QuadMesh& mesh, WallRowReport& report) {
    RowBuilder(loop, links, curves, mesh, report).run();
}

} // namespace hexopt
