#pragma once

#include "io/mesh_io.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace hexopt::test {

/// A block of x*y*z cells with shaken vertices, some of them at awkward numbers, with patches and arrays.
inline MeshFile sample_block(int x, int y, int z, std::uint64_t seed = 1) {
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    MeshFile file;
    HexMesh& mesh = file.mesh;
    const auto id = [&](int i, int j, int k) { return static_cast<Index>((k * (y + 1) + j) * (x + 1) + i); };
    for (int k = 0; k <= z; ++k)
        for (int j = 0; j <= y; ++j)
            for (int i = 0; i <= x; ++i)
                mesh.positions.push_back(
                    {i + 0.2 * uniform(), (j + 0.2 * uniform()) * 1e-7, (k + uniform()) * 1e9});
    mesh.positions[0] = {-0.0, 0x1p-1074, 1.7976931348623157e308};
    mesh.positions[1] = {M_PI, -1e-300, 0.1};
    for (int k = 0; k < z; ++k)
        for (int j = 0; j < y; ++j)
            for (int i = 0; i < x; ++i)
                mesh.cells.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                                      id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                                      id(i, j + 1, k + 1)});
    mesh.patch_names = {"patch_4", "patch_7"};
    for (int j = 0; j < y; ++j)
        for (int i = 0; i < x; ++i) {
            mesh.boundary.push_back(
                {{id(i, j, 0), id(i, j + 1, 0), id(i + 1, j + 1, 0), id(i + 1, j, 0)}, 1});
            mesh.boundary.push_back(
                {{id(i, j, z), id(i + 1, j, z), id(i + 1, j + 1, z), id(i, j + 1, z)}, 0});
        }
    for (std::size_t c = 0; c < mesh.cell_count(); ++c)
        mesh.level.push_back(static_cast<std::uint8_t>(random() % 5));

    FieldData quality{"scaled jacobian <&> \"%\"", FieldLocation::cell, 1, {}, FieldType::float64};
    FieldData vector{"displacement", FieldLocation::point, 3, {}, FieldType::float32};
    FieldData large{"large", FieldLocation::cell, 2, {}, FieldType::int64};
    FieldData material{"medit:ref", FieldLocation::cell, 1, {}, FieldType::int32};
    FieldData flag{"flag", FieldLocation::point, 1, {}, FieldType::uint8};
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
        quality.values.push_back(uniform() - 0.5);
        material.values.push_back(static_cast<double>(random() % 9) - 4);
        for (int i = 0; i < 2; ++i) large.values.push_back(static_cast<double>(random() >> 11) - 0x1p52);
    }
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        for (int i = 0; i < 3; ++i) vector.values.push_back(static_cast<float>(uniform() * 1e-30));
        flag.values.push_back(static_cast<double>(random() % 256));
    }
    quality.values[0] = std::numeric_limits<double>::infinity();
    file.fields = {flag, vector, quality, large, material};
    return file;
}

/// One cell beside eight of half its size: five hanging vertices in the face between them.
inline HexMesh sample_hanging() {
    HexMesh mesh;
    const auto id = [](int i, int j, int k) { return static_cast<Index>((k * 3 + j) * 3 + i); };
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) mesh.positions.push_back({1 + 0.5 * i, 0.5 * j, 0.5 * k});
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j) mesh.positions.push_back({0.0, 1.0 * j, 1.0 * k});
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i)
                mesh.cells.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                                      id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                                      id(i, j + 1, k + 1)});
    mesh.cells.push_back({27, id(0, 0, 0), id(0, 2, 0), 28, 29, id(0, 0, 2), id(0, 2, 2), 30});
    mesh.level = {1, 1, 1, 1, 1, 1, 1, 1, 0};
    const auto hang = [&](Index v, std::vector<Index> masters) {
        mesh.hanging.vertex.push_back(v);
        for (Index m : masters) mesh.hanging.master.push_back(m);
        for (std::size_t i = 0; i < masters.size(); ++i)
            mesh.hanging.weight.push_back(1.0 / static_cast<double>(masters.size()));
        mesh.hanging.offset.push_back(mesh.hanging.master.size());
    };
    hang(id(0, 1, 0), {id(0, 0, 0), id(0, 2, 0)});
    hang(id(0, 0, 1), {id(0, 0, 0), id(0, 0, 2)});
    hang(id(0, 1, 1), {id(0, 0, 0), id(0, 2, 0), id(0, 0, 2), id(0, 2, 2)});
    hang(id(0, 2, 1), {id(0, 2, 0), id(0, 2, 2)});
    hang(id(0, 1, 2), {id(0, 0, 2), id(0, 2, 2)});
    mesh.patch_names = {"inlet & outlet", "", "wänd 100%"};
    mesh.boundary = {{{27, 29, 30, 28}, 2}, {{id(2, 0, 0), id(2, 1, 0), id(2, 1, 1), id(2, 0, 1)}, 0}};
    return mesh;
}

inline bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

inline void check_same(const HexMesh& a, const HexMesh& b) {
    REQUIRE(a.vertex_count() == b.vertex_count());
    bool same = true;
    for (std::size_t v = 0; v < a.vertex_count(); ++v)
        for (int k = 0; k < 3; ++k) same = same && same_bits(a.positions[v][k], b.positions[v][k]);
    CHECK(same);
    CHECK(a.cells == b.cells);
    CHECK(a.level == b.level);
    CHECK(a.patch_names == b.patch_names);
    REQUIRE(a.boundary.size() == b.boundary.size());
    for (std::size_t q = 0; q < a.boundary.size(); ++q) {
        CHECK(a.boundary[q].vertices == b.boundary[q].vertices);
        CHECK(a.boundary[q].patch == b.boundary[q].patch);
    }
    CHECK(a.hanging.vertex == b.hanging.vertex);
    CHECK(a.hanging.offset == b.hanging.offset);
    CHECK(a.hanging.master == b.hanging.master);
    CHECK(a.hanging.weight == b.hanging.weight);
}

inline void check_same(const std::vector<FieldData>& a, const std::vector<FieldData>& b) {
    REQUIRE(a.size() == b.size());
    for (const FieldData& field : a) {
        const auto twin =
            std::find_if(b.begin(), b.end(), [&](const FieldData& f) { return f.name == field.name; });
        INFO(field.name);
        REQUIRE(twin != b.end());
        CHECK(twin->location == field.location);
        CHECK(twin->components == field.components);
        CHECK(twin->type == field.type);
        CHECK(twin->values == field.values);
    }
}

} // namespace hexopt::test
