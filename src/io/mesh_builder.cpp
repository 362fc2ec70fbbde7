#include "io/mesh_builder.hpp"

#include "mesh/topology.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <unordered_map>

namespace hexopt::io_detail {

namespace {

Error bad(std::string where, std::string reason, std::string advice) {
    return Error{ErrorCode::bad_input, "read", std::move(where), {std::move(reason), std::move(advice)}};
}

std::string plural(const std::string& name) {
    if (name.ends_with("hedron")) return name.substr(0, name.size() - 2) + "a";
    return name.ends_with("ex") ? name.substr(0, name.size() - 2) + "ices" : name + "s";
}

std::string list_counts(const std::map<std::string, std::size_t>& counts) {
    std::string text;
    for (const auto& [name, count] : counts)
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, count == 1 ? name : plural(name));
    return text;
}

std::string advice_on_id(std::size_t id, std::size_t vertex_count, int first_id) {
    if (first_id == 0 && id == vertex_count)
        return "ids of this format start at 0; this file may count from 1";
    return "the file is damaged; write or copy it again";
}

Status check_positions(const MeshBuilder& builder, const Locate& locate_point) {
    const auto& positions = builder.mesh.positions;
    for (std::size_t v = 0; v < positions.size(); ++v)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(positions[v][k]))
                return bad(locate_point(v),
                           fmt::format("vertex {} has {} coordinate {}", v + builder.first_id, "xyz"[k],
                                       positions[v][k]),
                           "give finite coordinates");
    return Done{};
}

Status check_cells(const MeshBuilder& builder, const Locate& locate_cell) {
    const std::size_t vertex_count = builder.mesh.positions.size();
    for (std::size_t c = 0; c < builder.mesh.cells.size(); ++c) {
        const Cell& cell = builder.mesh.cells[c];
        for (Index v : cell)
            if (v >= vertex_count)
                return bad(locate_cell(c),
                           fmt::format("hexahedron {} uses vertex {}, but there are {}", c + builder.first_id,
                                       v + builder.first_id, vertex_count),
                           advice_on_id(v, vertex_count, builder.first_id));
        Cell sorted = cell;
        std::sort(sorted.begin(), sorted.end());
        const auto twin = std::adjacent_find(sorted.begin(), sorted.end());
        if (twin != sorted.end())
            return bad(locate_cell(c),
                       fmt::format("hexahedron {} uses vertex {} twice", c + builder.first_id,
                                   *twin + builder.first_id),
                       "collapsed hexahedra are not supported; split them or mesh that place anew");
    }
    return Done{};
}

Quad sorted_key(Quad quad) {
    std::sort(quad.begin(), quad.end());
    return quad;
}

struct QuadHash {
    std::size_t operator()(const Quad& quad) const {
        std::uint64_t hash = 0;
        for (Index v : quad) hash = (hash ^ v) * 0x9E3779B97F4A7C15u, hash ^= hash >> 32;
        return hash;
    }
};

struct QuadUse {
    Index source;      ///< first quad of the file with these vertices
    std::uint8_t uses; ///< faces of cells with these vertices: 0, 1, 2 = more
    bool conflicting;  ///< listed again with another patch
    Quad seen_from_outside;
};

using QuadTable = std::unordered_map<Quad, QuadUse, QuadHash>;

QuadTable match_quads(const MeshBuilder& builder) {
    QuadTable table;
    table.reserve(builder.quads.size());
    for (Index q = 0; q < builder.quads.size(); ++q) {
        const SourceQuad& quad = builder.quads[q];
        const auto [entry, is_new] =
            table.try_emplace(sorted_key(quad.vertices), QuadUse{q, 0, false, quad.vertices});
        if (!is_new && builder.quads[entry->second.source].patch != quad.patch)
            entry->second.conflicting = true;
    }
    for (Index c = 0; c < builder.mesh.cells.size(); ++c)
        for (std::uint32_t f = 0; f < 6; ++f) {
            const Quad face = face_vertices(builder.mesh, {c, f});
            const auto entry = table.find(sorted_key(face));
            if (entry == table.end()) continue;
            QuadUse& use = entry->second;
            use.uses = static_cast<std::uint8_t>(std::min(use.uses + 1, 2));
            use.seen_from_outside = face;
        }
    return table;
}

/// The quad itself where it already runs counter-clockwise seen from outside, else reversed from its first
/// vertex.
Quad oriented(const Quad& quad, const Quad& outside) {
    const auto start = std::find(outside.begin(), outside.end(), quad[0]) - outside.begin();
    if (outside[(start + 1) % 4] == quad[1] && outside[(start + 2) % 4] == quad[2]) return quad;
    Quad turned;
    for (int k = 0; k < 4; ++k) turned[k] = outside[(start + k) % 4];
    return turned;
}

void collect_boundary(MeshBuilder& builder, const Context& context) {
    if (builder.quads.empty()) return;
    const QuadTable table = match_quads(builder);
    std::size_t inside = 0, loose = 0, conflicting = 0;
    for (Index q = 0; q < builder.quads.size(); ++q) {
        const SourceQuad& quad = builder.quads[q];
        const QuadUse& use = table.at(sorted_key(quad.vertices));
        if (use.source != q) continue;
        conflicting += use.conflicting;
        loose += use.uses == 0;
        inside += use.uses > 1;
        if (use.uses == 1)
            builder.mesh.boundary.push_back({oriented(quad.vertices, use.seen_from_outside), quad.patch});
    }
    const auto warn = [&](std::size_t count, const char* what) {
        if (count > 0)
            context.log(LogLevel::warning,
                        fmt::format("{}: {} quadrilaterals {}", builder.file, count, what));
    };
    warn(loose, "are no face of a hexahedron and are left out");
    warn(inside, "lie between two hexahedra and are left out: only patches of the boundary are kept");
    warn(conflicting, "are listed in more than one patch; the first counts");
}

Status check_quads(const MeshBuilder& builder) {
    const std::size_t vertex_count = builder.mesh.positions.size();
    for (std::size_t q = 0; q < builder.quads.size(); ++q)
        for (Index v : builder.quads[q].vertices)
            if (v >= vertex_count)
                return bad(builder.file,
                           fmt::format("quadrilateral {} uses vertex {}, but there are {}",
                                       q + builder.first_id, v + builder.first_id, vertex_count),
                           advice_on_id(v, vertex_count, builder.first_id));
    return Done{};
}

void warn_about_loose_vertices(const MeshBuilder& builder, const Context& context) {
    std::vector<bool> used(builder.mesh.positions.size(), false);
    for (const Cell& cell : builder.mesh.cells)
        for (Index v : cell) used[v] = true;
    const auto loose = std::count(used.begin(), used.end(), false);
    if (loose > 0)
        context.log(LogLevel::warning,
                    fmt::format("{}: {} vertices belong to no hexahedron; they are kept as they are",
                                builder.file, loose));
}

} // namespace

Index MeshBuilder::patch_of(const std::string& name) {
    const auto [entry, is_new] = patch_number_.try_emplace(name, static_cast<Index>(mesh.patch_names.size()));
    if (is_new) mesh.patch_names.push_back(name);
    return entry->second;
}

std::string describe_violation(const Hanging& hanging, std::size_t vertex_count) {
    constexpr double kSumTolerance = 1e-9;
    const std::size_t rows = hanging.count();
    if (hanging.offset.size() != rows + 1 || hanging.offset.front() != 0 ||
        hanging.offset.back() != hanging.master.size() || hanging.weight.size() != hanging.master.size())
        return "the arrays of hanging constraints do not fit together";
    std::vector<bool> hangs(vertex_count, false);
    for (std::size_t r = 0; r < rows; ++r) {
        const Index v = hanging.vertex[r];
        if (v >= vertex_count) return fmt::format("hanging vertex {} of {} vertices", v, vertex_count);
        if (r > 0 && hanging.vertex[r - 1] >= v) return fmt::format("hanging vertex {} is out of order", v);
        hangs[v] = true;
    }
    for (std::size_t r = 0; r < rows; ++r) {
        const Index v = hanging.vertex[r];
        if (hanging.offset[r] >= hanging.offset[r + 1] || hanging.offset[r + 1] > hanging.master.size())
            return fmt::format("hanging vertex {} has no masters", v);
        double sum = 0;
        for (std::size_t k = hanging.offset[r]; k < hanging.offset[r + 1]; ++k) {
            const Index master = hanging.master[k];
            if (master >= vertex_count) return fmt::format("master {} of {} vertices", master, vertex_count);
            if (hangs[master]) return fmt::format("master {} of hanging vertex {} hangs itself", master, v);
            if (k > hanging.offset[r] && hanging.master[k - 1] >= master)
                return fmt::format("masters of hanging vertex {} are out of order", v);
            if (!(hanging.weight[k] > 0))
                return fmt::format("hanging vertex {} has weight {}", v, hanging.weight[k]);
            sum += hanging.weight[k];
        }
        if (!(std::abs(sum - 1) <= kSumTolerance))
            return fmt::format("the weights of hanging vertex {} sum to {}, not 1", v, sum);
    }
    return {};
}

Result<MeshFile> MeshBuilder::finish(const Locate& locate_point, const Locate& locate_cell,
                                     const Context& context) {
    if (!unsupported.empty())
        return bad(
            file,
            fmt::format(
                "only hexahedra with 8 vertices are supported, but besides {} of them the file holds {}",
                mesh.cells.size(), list_counts(unsupported)),
            "convert these cells to hexahedra or remove them");
    if (mesh.cells.empty())
        return bad(
            file, ignored.empty() ? "holds no hexahedra" : "holds no hexahedra, only " + list_counts(ignored),
            "give a volume mesh of hexahedra");
    if (Status status = check_positions(*this, locate_point); !status) return status.error();
    if (Status status = check_cells(*this, locate_cell); !status) return status.error();
    if (Status status = check_quads(*this); !status) return status.error();
    if (const std::string violation = describe_violation(mesh.hanging, mesh.vertex_count());
        !violation.empty())
        return bad(file, violation, "remove the hexopt_hanging arrays or write the file again");
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "read", file, "cancelled while reading");

    if (!ignored.empty())
        context.log(LogLevel::warning,
                    fmt::format("{}: left out {}: only hexahedra and boundary quadrilaterals are used", file,
                                list_counts(ignored)));
    warn_about_loose_vertices(*this, context);
    collect_boundary(*this, context);
    return MeshFile{std::move(mesh), std::move(fields)};
}

} // namespace hexopt::io_detail
