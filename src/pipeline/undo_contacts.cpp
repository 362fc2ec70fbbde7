#include "pipeline/undo_contacts.hpp"

#include "mesh/hanging.hpp"
#include "quality/cell_quality.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <algorithm>

namespace hexopt {

namespace {

class ContactUndo {
  public:
    ContactUndo(HexMesh& mesh, const Topology& topology, std::span<const Point> before, double min_sj,
                const Parallel& parallel)
        : mesh_(mesh), topology_(topology), before_(before), min_sj_(min_sj), parallel_(parallel),
          after_(mesh.positions), had_(topology.boundary_faces.size(), 0), is_back_(mesh.vertex_count(), 0) {}

    std::size_t run() {
        std::vector<Index> touching = find_boundary_contacts(mesh_, topology_, parallel_);
        if (touching.empty()) return 0;
        mesh_.positions.assign(before_.begin(), before_.end());
        for (Index q : find_boundary_contacts(mesh_, topology_, parallel_)) had_[q] = 1;
        mesh_.positions = after_;
        while (!drop_had(touching).empty()) {
            const std::size_t count = back_count_;
            for (Index q : touching)
                for (Index v : mesh_.cells[topology_.boundary_faces[q].cell]) take_back_round(v);
            if (back_count_ == count) take_back_all();
            place();
            mend_cells();
            if (back_count_ == mesh_.vertex_count()) break;
            touching = find_boundary_contacts(mesh_, topology_, parallel_);
        }
        return count_moved_back();
    }

  private:
    std::vector<Index>& drop_had(std::vector<Index>& quads) const {
        std::erase_if(quads, [&](Index q) { return had_[q] != 0; });
        return quads;
    }

    void take_back(Index v) {
        if (!is_back_[v]) is_back_[v] = 1, ++back_count_;
    }

    void take_back_round(Index v) {
        for (const CellCorner& corner : topology_.vertex_cell[v])
            for (Index u : mesh_.cells[corner.cell]) take_back(u);
    }

    void take_back_all() {
        for (Index v = 0; v < mesh_.vertex_count(); ++v) take_back(v);
    }

    void place() {
        for (Index v = 0; v < mesh_.vertex_count(); ++v)
            mesh_.positions[v] = is_back_[v] ? before_[v] : after_[v];
        apply_hanging(mesh_, parallel_);
    }

    double usable_sj(std::span<const Point> positions, Index c) const {
        std::array<Point, 8> x;
        for (int k = 0; k < 8; ++k) x[k] = positions[mesh_.cells[c][k]];
        const CellValidity validity = compute_cell_validity(x);
        return validity.is_usable() ? validity.scaled_jacobian : -1;
    }

    /// Cells of which a part went back go back whole where that made them worse.
    void mend_cells() {
        for (bool any = true; any;) {
            any = false;
            std::vector<Index> worse;
            for (Index c = 0; c < mesh_.cell_count(); ++c) {
                const Cell& cell = mesh_.cells[c];
                const auto back =
                    std::count_if(cell.begin(), cell.end(), [&](Index v) { return is_back_[v]; });
                if (back == 0 || back == 8) continue;
                if (usable_sj(mesh_.positions, c) <
                    std::min({usable_sj(before_, c), usable_sj(after_, c), min_sj_}))
                    worse.push_back(c);
            }
            const std::size_t count = back_count_;
            for (Index c : worse)
                for (Index v : mesh_.cells[c]) take_back(v);
            any = back_count_ > count;
            if (any) place();
        }
    }

    std::size_t count_moved_back() const {
        std::size_t count = 0;
        for (Index v = 0; v < mesh_.vertex_count(); ++v) count += is_back_[v] && before_[v] != after_[v];
        return count;
    }

    HexMesh& mesh_;
    const Topology& topology_;
    std::span<const Point> before_;
    const double min_sj_;
    const Parallel& parallel_;
    const std::vector<Point> after_;
    std::vector<std::uint8_t> had_;     ///< per boundary face: touched others before
    std::vector<std::uint8_t> is_back_; ///< per vertex
    std::size_t back_count_ = 0;
};

} // namespace

std::size_t undo_contacts(HexMesh& mesh, const Topology& topology, std::span<const Point> before,
                          double min_sj, const Parallel& parallel) {
    return ContactUndo(mesh, topology, before, min_sj, parallel).run();
}

} // namespace hexopt
