#include "mesh/root_joints.hpp"

#include "mesh/constraint_midpoints.hpp"
#include "mesh/flat_table.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace hexopt {

namespace {

Error refusal(const std::string& where, std::string reason) {
    return make_error(ErrorCode::bad_input, "refine", where, "the initial mesh " + std::move(reason));
}

std::uint64_t edge_key(Index a, Index b) {
    const auto [low, high] = std::minmax(a, b);
    return std::uint64_t{low} << 32 | high;
}

bool has(const Quad& quad, Index v) { return std::find(quad.begin(), quad.end(), v) != quad.end(); }

/// The vertex that two faces share besides `known`; kNoIndex if there is not exactly one.
Index shared_vertex(const Quad& a, const Quad& b, Index known) {
    Index found = kNoIndex;
    for (Index v : a) {
        if (v == known || !has(b, v)) continue;
        if (found != kNoIndex) return kNoIndex;
        found = v;
    }
    return found;
}

class JointSearch {
  public:
    explicit JointSearch(const HexMesh& mesh) : mesh_(mesh) {}

    Result<RootJoints> run(const Parallel& parallel) {
        const Topology topology = compute_topology(mesh_, parallel);
        for (std::size_t row = 0; row < topology.coarse_faces.size(); ++row)
            if (!add_face(topology.coarse_faces[row], topology.fine_faces[row]))
                return refusal("cell " + std::to_string(topology.coarse_faces[row].cell),
                               "has a face there that is not cut into four: cells on its two sides must be "
                               "at most one halving along every axis apart");
        add_edges();
        if (Status ok = find_levels(); !ok) return ok.error();
        return std::move(joints_);
    }

  private:
    bool add_face(CellFace coarse, std::span<const CellFace> fine) {
        if (fine.size() != 4) return false;
        RootJoints::Face face{coarse, {}, face_vertices(mesh_, coarse), {}, kNoIndex};
        std::array<Quad, 4> quads;
        for (int k = 0; k < 4; ++k) {
            const auto at = std::find_if(fine.begin(), fine.end(), [&](CellFace f) {
                return has(face_vertices(mesh_, f), face.corner[k]);
            });
            if (at == fine.end()) return false;
            face.fine[k] = *at;
            quads[k] = face_vertices(mesh_, *at);
        }
        face.centre = shared_vertex(quads[0], quads[2], kNoIndex);
        if (face.centre == kNoIndex || !has(quads[1], face.centre) || !has(quads[3], face.centre))
            return false;
        for (int k = 0; k < 4; ++k) {
            face.middle[k] = shared_vertex(quads[k], quads[(k + 1) % 4], face.centre);
            if (face.middle[k] == kNoIndex) return false;
        }
        for (int k = 0; k < 4; ++k)
            for (Index v : quads[k])
                if (!has({face.corner[k], face.middle[k], face.centre, face.middle[(k + 3) % 4]}, v))
                    return false;
        joints_.faces.push_back(face);
        return true;
    }

    void add_edges() {
        const ConstraintMidpoints midpoints(mesh_);
        edge_of_cell_.resize(12 * mesh_.cell_count());
        std::vector<Index> found;
        for (std::size_t use = 0; use < edge_of_cell_.size(); ++use) {
            const Cell& cell = mesh_.cells[use / 12];
            const Index a = cell[hex::kEdgeVertex[use % 12][0]], b = cell[hex::kEdgeVertex[use % 12][1]];
            const auto fresh = static_cast<Index>(edge_at_.size());
            edge_of_cell_[use] = edge_at_.find_or_insert(edge_key(a, b), fresh);
            if (edge_of_cell_[use] != fresh) continue;
            found.clear();
            midpoints.find(a, b, found);
            if (!found.empty()) joints_.edges.push_back({std::min(a, b), std::max(a, b), found.front()});
        }
    }

    /// Levels of edges are those of the cells that list them; a half is one higher than the whole.
    Status find_levels() {
        struct Step {
            Index edge;
            int rise;
        };
        std::vector<std::vector<Step>> halves(edge_at_.size());
        for (const RootJoints::Edge& edge : joints_.edges) {
            const Index whole = edge_at_.find(edge_key(edge.from, edge.to));
            for (Index end : {edge.from, edge.to})
                if (const Index half = edge_at_.find(edge_key(end, edge.middle)); half != kNoIndex) {
                    halves[whole].push_back({half, 1});
                    halves[half].push_back({whole, -1});
                }
        }
        std::vector<std::vector<Index>> cells(edge_at_.size());
        for (std::size_t use = 0; use < edge_of_cell_.size(); ++use)
            cells[edge_of_cell_[use]].push_back(static_cast<Index>(use / 12));
        constexpr int kUnknown = std::numeric_limits<int>::max();
        std::vector<int> cell_level(mesh_.cell_count(), kUnknown), edge_level(edge_at_.size(), kUnknown);
        joints_.level.resize(mesh_.cell_count());
        std::vector<Index> part, open;
        for (Index first = 0; first < mesh_.cell_count(); ++first) {
            if (cell_level[first] != kUnknown) continue;
            cell_level[first] = 0;
            part.assign(1, first);
            for (std::size_t next = 0; next < part.size(); ++next)
                for (int e = 0; e < 12; ++e) {
                    open.assign(1, edge_of_cell_[12 * std::size_t{part[next]} + static_cast<std::size_t>(e)]);
                    if (!set_level(edge_level[open[0]], cell_level[part[next]])) return conflict(part[next]);
                    while (!open.empty()) {
                        const Index edge = open.back();
                        open.pop_back();
                        for (const Step& step : halves[edge]) {
                            const bool is_new = edge_level[step.edge] == kUnknown;
                            if (!set_level(edge_level[step.edge], edge_level[edge] + step.rise))
                                return conflict(part[next]);
                            if (is_new) open.push_back(step.edge);
                        }
                        for (Index cell : cells[edge]) {
                            if (cell_level[cell] == kUnknown) part.push_back(cell);
                            if (!set_level(cell_level[cell], edge_level[edge])) return conflict(cell);
                        }
                    }
                }
            const int least = cell_level[*std::min_element(
                part.begin(), part.end(), [&](Index a, Index b) { return cell_level[a] < cell_level[b]; })];
            for (Index cell : part) {
                if (cell_level[cell] - least > 200) return conflict(cell);
                joints_.level[cell] = static_cast<std::uint8_t>(cell_level[cell] - least);
            }
        }
        return check_chains();
    }

    static bool set_level(int& level, int value) {
        if (level == std::numeric_limits<int>::max()) level = value;
        return level == value;
    }

    Status conflict(Index cell) const {
        return refusal("cell " + std::to_string(cell),
                       "has cells of sizes there that are no halvings of one another");
    }

    /// A half that is halved itself would have to share numbers with cells two halvings larger.
    Status check_chains() const {
        std::vector<std::uint8_t> is_half(edge_at_.size(), 0);
        for (const RootJoints::Edge& edge : joints_.edges)
            for (Index end : {edge.from, edge.to})
                if (const Index half = edge_at_.find(edge_key(end, edge.middle)); half != kNoIndex)
                    is_half[half] = 1;
        for (const RootJoints::Edge& edge : joints_.edges)
            if (is_half[edge_at_.find(edge_key(edge.from, edge.to))])
                return refusal("vertex " + std::to_string(edge.middle),
                               "has cells along an edge there that are more than one halving apart");
        return Done{};
    }

    const HexMesh& mesh_;
    RootJoints joints_;
    FlatTable edge_at_;
    std::vector<Index> edge_of_cell_; ///< 12 a cell
};

} // namespace

Result<RootJoints> find_root_joints(const HexMesh& mesh, const Parallel& parallel) {
    if (mesh.hanging.empty()) return RootJoints{};
    return JointSearch(mesh).run(parallel);
}

} // namespace hexopt
