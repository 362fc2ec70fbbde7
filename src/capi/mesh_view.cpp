#include "capi/mesh_view.hpp"

#include "io/mesh_builder.hpp"
#include "mesh/hanging.hpp"

#include <array>
#include <cmath>
#include <map>
#include <span>

namespace hexopt::capi {

namespace {

struct ArrayCheck {
    const char* name;
    const void* array;
    std::size_t count;
};

Status check_arrays(const char* what, std::initializer_list<ArrayCheck> checks) {
    for (const ArrayCheck& check : checks) {
        if (check.count > 0 && check.array == nullptr)
            return usage_error(what, std::string(check.name) + " is NULL");
        if (check.count >= kNoIndex)
            return usage_error(what, std::string(check.name) + " has more than 2^32 - 2 entries");
    }
    return Done{};
}

Error bad_input(const char* what, std::string where, std::string reason) {
    return make_error(ErrorCode::bad_input, what, std::move(where), std::move(reason));
}

Result<std::vector<Point>> copy_positions(const char* what, const double* xyz, std::size_t count) {
    std::vector<Point> positions(count);
    for (std::size_t v = 0; v < count; ++v) {
        for (int k = 0; k < 3; ++k) positions[v][k] = xyz[3 * v + k];
        if (!std::isfinite(positions[v].x + positions[v].y + positions[v].z))
            return bad_input(what, "vertex " + std::to_string(v), "has a coordinate that is not finite");
    }
    return positions;
}

Result<Hanging> copy_hanging(const hexopt_mesh& mesh) {
    Hanging rows;
    for (std::size_t i = 0; i < mesh.hanging_count; ++i) {
        const std::uint64_t first = mesh.hanging_offset[i], last = mesh.hanging_offset[i + 1];
        if (first > last || (i == 0 && first != 0))
            return bad_input("hexopt_mesh", "hanging_offset " + std::to_string(i), "does not rise from 0");
        append_row(rows, mesh.hanging_vertex[i], std::span(mesh.hanging_master + first, last - first),
                   std::span(mesh.hanging_weight + first, last - first));
    }
    return close_hanging(rows, mesh.vertex_count);
}

void add_quads(io_detail::MeshBuilder& builder, const hexopt_mesh& mesh) {
    std::map<std::uint32_t, Index> patch_number;
    for (std::size_t q = 0; q < mesh.patch_quad_count; ++q) {
        const std::uint32_t* v = mesh.patch_quads + 4 * q;
        auto [entry, is_new] = patch_number.try_emplace(mesh.quad_patch[q], 0);
        if (is_new) entry->second = builder.patch_of(std::to_string(mesh.quad_patch[q]));
        builder.quads.push_back({Quad{v[0], v[1], v[2], v[3]}, entry->second});
    }
}

Status check_quads(const hexopt_mesh& mesh) {
    for (std::size_t i = 0; i < 4 * mesh.patch_quad_count; ++i)
        if (mesh.patch_quads[i] >= mesh.vertex_count)
            return bad_input("hexopt_mesh", "patch quad " + std::to_string(i / 4),
                             "uses a vertex that does not exist");
    return Done{};
}

} // namespace

Result<HexMesh> copy_mesh(const hexopt_mesh* given, const Context& context) {
    if (!given) return usage_error("hexopt_mesh", "is NULL");
    hexopt_mesh mesh = HEXOPT_MESH_INIT;
    if (auto status = read_struct(given, "hexopt_mesh", mesh); !status) return status.error();
    if (auto status =
            check_arrays("hexopt_mesh", {{"positions", mesh.positions, mesh.vertex_count},
                                         {"cells", mesh.cells, mesh.cell_count},
                                         {"hanging_vertex", mesh.hanging_vertex, mesh.hanging_count},
                                         {"hanging_offset", mesh.hanging_offset, mesh.hanging_count},
                                         {"hanging_master", mesh.hanging_master, mesh.hanging_count},
                                         {"hanging_weight", mesh.hanging_weight, mesh.hanging_count},
                                         {"patch_quads", mesh.patch_quads, mesh.patch_quad_count},
                                         {"quad_patch", mesh.quad_patch, mesh.patch_quad_count}});
        !status)
        return status.error();
    if (auto status = check_quads(mesh); !status) return status.error();

    io_detail::MeshBuilder builder("hexopt_mesh");
    auto positions = copy_positions("hexopt_mesh", mesh.positions, mesh.vertex_count);
    if (!positions) return positions.error();
    builder.mesh.positions = std::move(*positions);
    builder.mesh.cells.resize(mesh.cell_count);
    for (std::size_t c = 0; c < mesh.cell_count; ++c)
        for (int k = 0; k < 8; ++k) builder.mesh.cells[c][k] = mesh.cells[8 * c + k];
    auto hanging = copy_hanging(mesh);
    if (!hanging) return hanging.error();
    builder.mesh.hanging = std::move(*hanging);
    add_quads(builder, mesh);

    auto file = builder.finish([](std::size_t v) { return "vertex " + std::to_string(v); },
                               [](std::size_t c) { return "cell " + std::to_string(c); }, context);
    if (!file) return file.error();
    return std::move(file->mesh);
}

Result<TriangleSoup> copy_surface(const hexopt_surface* given) {
    hexopt_surface surface = HEXOPT_SURFACE_INIT;
    if (auto status = read_struct(given, "hexopt_surface", surface); !status) return status.error();
    if (auto status =
            check_arrays("hexopt_surface", {{"positions", surface.positions, surface.vertex_count},
                                            {"triangles", surface.triangles, surface.triangle_count}});
        !status)
        return status.error();
    TriangleSoup soup;
    auto positions = copy_positions("hexopt_surface", surface.positions, surface.vertex_count);
    if (!positions) return positions.error();
    soup.vertices = std::move(*positions);
    std::map<std::uint32_t, Index> patch_number;
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
        const std::uint32_t* v = surface.triangles + 3 * t;
        for (int k = 0; k < 3; ++k)
            if (v[k] >= surface.vertex_count)
                return bad_input("hexopt_surface", "triangle " + std::to_string(t),
                                 "uses a vertex that does not exist");
        soup.triangles.push_back({v[0], v[1], v[2]});
        if (!surface.triangle_patch) continue;
        const auto [entry, is_new] =
            patch_number.try_emplace(surface.triangle_patch[t], static_cast<Index>(patch_number.size()));
        if (is_new) soup.patch_names.push_back(std::to_string(surface.triangle_patch[t]));
        soup.patch.push_back(entry->second);
    }
    return soup;
}

Result<FeatureLines> copy_feature_lines(const double* segments, std::size_t count) {
    const char* const kWhat = "hexopt_optimize_options";
    if (auto status = check_arrays(kWhat, {{"feature_segments", segments, count}}); !status)
        return status.error();
    FeatureLines lines;
    for (std::size_t i = 0; i < count; ++i) {
        const double* x = segments + 6 * i;
        const Point a(x[0], x[1], x[2]), b(x[3], x[4], x[5]);
        for (const Point& p : {a, b})
            if (!std::isfinite(p.x + p.y + p.z))
                return bad_input(kWhat, "feature segment " + std::to_string(i),
                                 "has a coordinate that is not finite");
        if (a != b) lines.segments.push_back({a, b});
    }
    return lines;
}

void write_positions(const std::vector<Point>& positions, double* target) {
    for (std::size_t v = 0; v < positions.size(); ++v)
        for (int k = 0; k < 3; ++k) target[3 * v + k] = positions[v][k];
}

} // namespace hexopt::capi
