#include "mesh/validate_structure.hpp"

#include "mesh/face_groups.hpp"
#include "mesh/hanging.hpp"
#include "mesh/topology.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace hexopt {

namespace {

constexpr std::size_t kPlaceCount = 5;

std::string at_vertex(std::size_t vertex) { return fmt::format("vertex {}", vertex); }

/// Cyclic position of b relative to a: same sense, opposite sense or neither.
enum class Sense { same, opposite, twisted };

Sense sense_of(const Quad& a, const Quad& b) {
    const auto at = std::find(b.begin(), b.end(), a[0]) - b.begin();
    if (at == 4 || a[2] != b[(at + 2) % 4]) return Sense::twisted;
    return a[1] == b[(at + 1) % 4] ? Sense::same : Sense::opposite;
}

class Checker {
  public:
    Checker(const HexMesh& mesh, const Parallel& parallel) : mesh_(mesh), parallel_(parallel) {}

    std::vector<Violation> check() {
        if (mesh_.vertex_count() >= kNoIndex || mesh_.cell_count() > CellCorner::kMostCells) {
            add(ViolationKind::too_large,
                fmt::format("vertices {}, cells {}", mesh_.vertex_count(), mesh_.cell_count()));
            return list();
        }
        if (!mesh_.level.empty() && mesh_.level.size() != mesh_.cell_count())
            add(ViolationKind::level_count,
                fmt::format("{} levels for {} cells", mesh_.level.size(), mesh_.cell_count()));
        const bool ids_are_sound = check_ids();
        check_hanging();
        check_boundary_ids();
        if (ids_are_sound) {
            check_positions();
            const Csr<CellCorner> vertex_cell = compute_vertex_cell(mesh_);
            check_cells(vertex_cell);
            check_faces(vertex_cell);
            if (!found_.contains(ViolationKind::boundary_out_of_range)) check_boundary_faces(vertex_cell);
        }
        return list();
    }

  private:
    void add(ViolationKind kind, const std::string& place) {
        Violation& violation = found_[kind];
        violation.kind = kind;
        violation.is_notice = kind >= ViolationKind::boundary_not_a_face;
        if (++violation.count <= kPlaceCount) violation.places.push_back(place);
    }

    std::vector<Violation> list() const {
        std::vector<Violation> all;
        for (const auto& [kind, violation] : found_) all.push_back(violation);
        return all;
    }

    bool check_ids() {
        bool sound = true;
        for (std::size_t c = 0; c < mesh_.cell_count(); ++c) {
            Cell sorted = mesh_.cells[c];
            std::sort(sorted.begin(), sorted.end());
            if (sorted.back() >= mesh_.vertex_count()) {
                add(ViolationKind::vertex_out_of_range, fmt::format("cell {}: vertex {}", c, sorted.back()));
                sound = false;
            }
            if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
                add(ViolationKind::repeated_vertex, fmt::format("cell {}: vertex {}", c, *twice));
        }
        return sound;
    }

    void check_positions() {
        std::vector<std::uint8_t> is_used(mesh_.vertex_count(), 0);
        for (const Cell& cell : mesh_.cells)
            for (Index v : cell) is_used[v] = 1;
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v) {
            const Point& p = mesh_.positions[v];
            if (!is_used[v])
                add(ViolationKind::unused_vertex, at_vertex(v));
            else if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
                add(ViolationKind::position_not_finite, at_vertex(v));
        }
    }

    void check_cells(const Csr<CellCorner>& vertex_cell) {
        std::vector<std::pair<Cell, Index>> cells;
        for (Index v = 0; v < mesh_.vertex_count(); ++v) {
            cells.clear();
            for (CellCorner at : vertex_cell[v]) {
                Cell sorted = mesh_.cells[at.cell];
                std::sort(sorted.begin(), sorted.end());
                if (sorted[0] == v && (cells.empty() || cells.back().second != at.cell))
                    cells.emplace_back(sorted, Index{at.cell});
            }
            std::sort(cells.begin(), cells.end());
            for (std::size_t i = 1; i < cells.size(); ++i)
                if (cells[i].first == cells[i - 1].first)
                    add(ViolationKind::duplicate_cell,
                        fmt::format("cell {}: same as cell {}", cells[i].second, cells[i - 1].second));
        }
    }

    struct FaceFinding {
        ViolationKind kind;
        CellFace first, second;
    };

    void judge_group(std::span<const KeyedFace> group, std::vector<FaceFinding>& findings) const {
        if (group.size() < 2) return;
        const CellFace a = group[0].face, b = group[1].face;
        if (group.size() > 2) return findings.push_back({ViolationKind::face_overused, a, group.back().face});
        const Sense sense = sense_of(face_vertices(mesh_, a), face_vertices(mesh_, b));
        if (sense == Sense::same) findings.push_back({ViolationKind::face_inconsistent, a, b});
        if (sense == Sense::twisted) findings.push_back({ViolationKind::face_twisted, a, b});
    }

    void check_faces(const Csr<CellCorner>& vertex_cell) {
        constexpr std::size_t kChunk = 8192;
        std::vector<std::vector<FaceFinding>> findings(mesh_.vertex_count() / kChunk + 1);
        parallel_.for_chunks(mesh_.vertex_count(), kChunk, [&](std::size_t begin, std::size_t end) {
            std::vector<KeyedFace> faces;
            for (std::size_t v = begin; v < end; ++v) {
                gather_faces(mesh_, vertex_cell[v], static_cast<Index>(v), faces);
                for (std::size_t i = 0; i < faces.size();) {
                    std::size_t next = i + 1;
                    while (next < faces.size() && faces[next].others == faces[i].others) ++next;
                    judge_group({faces.data() + i, next - i}, findings[begin / kChunk]);
                    i = next;
                }
            }
        });
        for (const auto& part : findings)
            for (const FaceFinding& finding : part) {
                add(finding.kind,
                    fmt::format("cells {} and {}: face {}", finding.first.cell, finding.second.cell,
                                fmt::join(face_vertices(mesh_, finding.first), " ")));
            }
    }

    bool check_hanging_shape() {
        const Hanging& h = mesh_.hanging;
        const bool fits = h.offset.size() == h.vertex.size() + 1 && h.offset.front() == 0 &&
                          h.offset.back() == h.master.size() && h.master.size() == h.weight.size() &&
                          std::is_sorted(h.offset.begin(), h.offset.end());
        if (!fits) {
            add(ViolationKind::hanging_shape, "array lengths");
            return false;
        }
        for (std::size_t row = 0; row < h.count(); ++row) {
            const auto *begin = h.master.data() + h.offset[row], *end = h.master.data() + h.offset[row + 1];
            if (begin == end)
                add(ViolationKind::hanging_shape, fmt::format("vertex {}: no masters", h.vertex[row]));
            if (row > 0 && h.vertex[row] <= h.vertex[row - 1])
                add(ViolationKind::hanging_shape, fmt::format("vertex {}: rows not sorted", h.vertex[row]));
            if (std::adjacent_find(begin, end, std::greater_equal<>()) != end)
                add(ViolationKind::hanging_shape,
                    fmt::format("vertex {}: masters not sorted", h.vertex[row]));
        }
        return true;
    }

    void check_hanging() {
        if (!check_hanging_shape()) return;
        const Hanging& h = mesh_.hanging;
        const std::size_t count = mesh_.vertex_count();
        std::vector<std::uint8_t> hangs(count, 0);
        for (Index v : h.vertex)
            if (v < count)
                hangs[v] = 1;
            else
                add(ViolationKind::hanging_out_of_range, at_vertex(v));
        for (std::size_t row = 0; row < h.count(); ++row) {
            double sum = 0;
            bool positive = true;
            for (std::size_t k = h.offset[row]; k < h.offset[row + 1]; ++k) {
                sum += h.weight[k];
                positive &= h.weight[k] > 0;
                const std::string place = fmt::format("vertex {}: master {}", h.vertex[row], h.master[k]);
                if (h.master[k] >= count)
                    add(ViolationKind::hanging_out_of_range, place);
                else if (hangs[h.master[k]])
                    add(ViolationKind::hanging_open, place);
            }
            if (!positive || !(std::abs(sum - 1) <= 1e-6))
                add(ViolationKind::hanging_weights, fmt::format("vertex {}: sum {}", h.vertex[row], sum));
        }
    }

    void check_boundary_ids() {
        for (std::size_t i = 0; i < mesh_.boundary.size(); ++i) {
            const BoundaryQuad& quad = mesh_.boundary[i];
            const Index highest = *std::max_element(quad.vertices.begin(), quad.vertices.end());
            if (highest >= mesh_.vertex_count())
                add(ViolationKind::boundary_out_of_range,
                    fmt::format("boundary quad {}: vertex {}", i, highest));
            else if (quad.patch >= mesh_.patch_names.size())
                add(ViolationKind::boundary_out_of_range,
                    fmt::format("boundary quad {}: patch {}", i, quad.patch));
        }
    }

    void check_boundary_faces(const Csr<CellCorner>& vertex_cell) {
        std::vector<KeyedFace> faces;
        for (std::size_t i = 0; i < mesh_.boundary.size(); ++i) {
            Quad key = mesh_.boundary[i].vertices;
            std::sort(key.begin(), key.end());
            gather_faces(mesh_, vertex_cell[key[0]], key[0], faces);
            const auto users = std::count_if(faces.begin(), faces.end(), [&](const KeyedFace& face) {
                return face.others == std::array<Index, 3>{key[1], key[2], key[3]};
            });
            if (users != 1)
                add(ViolationKind::boundary_not_a_face,
                    fmt::format("boundary quad {}: {}", i, fmt::join(mesh_.boundary[i].vertices, " ")));
        }
    }

    const HexMesh& mesh_;
    const Parallel& parallel_;
    std::map<ViolationKind, Violation> found_;
};

} // namespace

const char* name_of(ViolationKind kind) {
    switch (kind) {
    case ViolationKind::too_large:
        return "too_large";
    case ViolationKind::vertex_out_of_range:
        return "vertex_out_of_range";
    case ViolationKind::repeated_vertex:
        return "repeated_vertex";
    case ViolationKind::position_not_finite:
        return "position_not_finite";
    case ViolationKind::duplicate_cell:
        return "duplicate_cell";
    case ViolationKind::face_overused:
        return "face_overused";
    case ViolationKind::face_inconsistent:
        return "face_inconsistent";
    case ViolationKind::face_twisted:
        return "face_twisted";
    case ViolationKind::level_count:
        return "level_count";
    case ViolationKind::hanging_shape:
        return "hanging_shape";
    case ViolationKind::hanging_out_of_range:
        return "hanging_out_of_range";
    case ViolationKind::hanging_weights:
        return "hanging_weights";
    case ViolationKind::hanging_open:
        return "hanging_open";
    case ViolationKind::boundary_out_of_range:
        return "boundary_out_of_range";
    case ViolationKind::boundary_not_a_face:
        return "boundary_not_a_face";
    case ViolationKind::unused_vertex:
        return "unused_vertex";
    }
    return "unknown";
}

std::string Violation::one_line() const {
    return fmt::format("{}: {} ({}{})", name_of(kind), count, fmt::join(places, "; "),
                       count > places.size() ? "; ..." : "");
}

std::vector<Violation> validate_structure(const HexMesh& mesh, const Parallel& parallel) {
    return Checker(mesh, parallel).check();
}

Status require_structure(const HexMesh& mesh, const std::string& stage, const Parallel& parallel) {
    Error error{ErrorCode::bad_input, stage, "", {}};
    for (const Violation& violation : validate_structure(mesh, parallel)) {
        if (violation.is_notice) continue;
        if (error.where.empty()) error.where = violation.places.front();
        error.reasons.push_back(violation.one_line());
    }
    if (error.reasons.empty()) return Done{};
    return error;
}

} // namespace hexopt
