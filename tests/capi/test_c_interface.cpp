#include "capi/grid.hpp"

#include <catch2/catch.hpp>
#include <hexopt/hexopt.h>

#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>

namespace {

using ContextPointer = std::unique_ptr<hexopt_context, decltype(&hexopt_context_destroy)>;

ContextPointer make_context(const hexopt_context_options* options = nullptr) {
    hexopt_context* context = nullptr;
    REQUIRE(hexopt_context_create(options, &context) == HEXOPT_OK);
    return {context, &hexopt_context_destroy};
}

hexopt_mesh view(Grid& grid) {
    hexopt_mesh mesh = HEXOPT_MESH_INIT;
    mesh.vertex_count = grid.positions.size() / 3;
    mesh.positions = grid.positions.data();
    mesh.cell_count = grid.cells.size() / 8;
    mesh.cells = grid.cells.data();
    return mesh;
}

hexopt_optimize_options fixed_boundary() {
    hexopt_optimize_options options = HEXOPT_OPTIMIZE_OPTIONS_INIT;
    options.boundary = HEXOPT_BOUNDARY_FIXED;
    return options;
}

} // namespace

TEST_CASE("a tangled mesh is optimized in the caller's array") {
    const ContextPointer context = make_context();
    Grid grid(4);
    const std::vector<double> ideal = grid.positions;
    grid.tangle();
    hexopt_mesh mesh = view(grid);
    const hexopt_optimize_options options = fixed_boundary();
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    REQUIRE(hexopt_optimize(context.get(), &mesh, nullptr, &options, &result) == HEXOPT_OK);
    CHECK(std::string(hexopt_context_message(context.get())).empty());
    CHECK(result.concave32_before > 0);
    CHECK(result.concave32_after == 0);
    CHECK(result.min_sj_after > 0.9);
    for (int v = 0; v < 5 * 5 * 5; ++v) {
        const int x = v % 5, y = v / 5 % 5, z = v / 25;
        if (x % 4 == 0 || y % 4 == 0 || z % 4 == 0)
            for (int k = 0; k < 3; ++k) CHECK(grid.positions[3 * v + k] == ideal[3 * v + k]);
    }

    hexopt_quality quality = HEXOPT_QUALITY_INIT;
    REQUIRE(hexopt_measure(context.get(), &mesh, &quality) == HEXOPT_OK);
    CHECK(quality.valid == 64);
    CHECK(quality.min_sj == result.min_sj_after);
}

TEST_CASE("hanging vertices and patches are taken in and checked") {
    const ContextPointer context = make_context();
    Grid grid(1);
    const std::uint32_t v[] = {grid.vertex(0, 0, 0)}, masters[] = {1, 2};
    const std::uint64_t offset[] = {0, 2};
    double weights[] = {0.5, 0.25};
    hexopt_mesh mesh = view(grid);
    mesh.hanging_count = 1;
    mesh.hanging_vertex = v;
    mesh.hanging_offset = offset;
    mesh.hanging_master = masters;
    mesh.hanging_weight = weights;
    hexopt_quality quality = HEXOPT_QUALITY_INIT;
    CHECK(hexopt_measure(context.get(), &mesh, &quality) == HEXOPT_BAD_INPUT);
    weights[1] = 0.5;
    CHECK(hexopt_measure(context.get(), &mesh, &quality) == HEXOPT_OK);

    const std::uint32_t quad[] = {0, 1, 3, 99}, patch[] = {7};
    mesh.hanging_count = 0;
    mesh.patch_quad_count = 1;
    mesh.patch_quads = quad;
    mesh.quad_patch = patch;
    CHECK(hexopt_measure(context.get(), &mesh, &quality) == HEXOPT_BAD_INPUT);
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains("patch quad 0"));
}

TEST_CASE("the boundary moves onto a given surface") {
    // The cube's bottom is dented; the surface says that it is flat.
    const ContextPointer context = make_context();
    Grid grid(2);
    grid.positions[3 * grid.vertex(1, 1, 0) + 2] = 0.2;
    double corners[24];
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) corners[3 * v + k] = v >> k & 1 ? 2 : 0;
    const std::uint32_t triangles[] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    hexopt_surface surface = HEXOPT_SURFACE_INIT;
    surface.vertex_count = 8;
    surface.positions = corners;
    surface.triangle_count = 12;
    surface.triangles = triangles;
    hexopt_mesh mesh = view(grid);
    REQUIRE(hexopt_optimize(context.get(), &mesh, &surface, nullptr, nullptr) == HEXOPT_OK);
    CHECK(grid.positions[3 * grid.vertex(1, 1, 0) + 2] == 0);

    const std::uint32_t damaged[] = {0, 1, 8};
    surface.triangles = damaged;
    surface.triangle_count = 1;
    CHECK(hexopt_optimize(context.get(), &mesh, &surface, nullptr, nullptr) == HEXOPT_BAD_INPUT);
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains("triangle 0"));
}

TEST_CASE("the result says how far the boundary is from the surface") {
    // The surface's bottom is a flat pyramid whose tip lies where the mesh has no vertex.
    const ContextPointer context = make_context();
    Grid grid(2);
    double positions[27] = {};
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) positions[3 * v + k] = v >> k & 1 ? 2 : 0;
    positions[24] = positions[25] = 0.5, positions[26] = -0.1;
    const std::uint32_t triangles[] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7,
                                       2, 7, 3, 0, 2, 8, 2, 3, 8, 3, 1, 8, 1, 0, 8, 4, 5, 7, 4, 7, 6};
    hexopt_surface surface = HEXOPT_SURFACE_INIT;
    surface.vertex_count = 9;
    surface.positions = positions;
    surface.triangle_count = 14;
    surface.triangles = triangles;
    hexopt_mesh mesh = view(grid);
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    REQUIRE(hexopt_optimize(context.get(), &mesh, &surface, nullptr, &result) == HEXOPT_OK);
    CHECK(result.max_deviation > 0.01);
    CHECK(result.max_deviation < 0.1);
}

TEST_CASE("damaged meshes are refused by name, and their positions stay") {
    const ContextPointer context = make_context();
    Grid grid(2);
    grid.tangle();
    const std::vector<double> input = grid.positions;
    hexopt_mesh mesh = view(grid);
    const hexopt_optimize_options options = fixed_boundary();
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    const auto optimize = [&] { return hexopt_optimize(context.get(), &mesh, nullptr, &options, &result); };
    std::string expected;
    SECTION("vertex number") {
        grid.cells[11] = 27;
        CHECK(optimize() == HEXOPT_BAD_INPUT);
        expected = "cell 1";
    }
    SECTION("repeated vertex") {
        grid.cells[11] = grid.cells[12];
        CHECK(optimize() == HEXOPT_BAD_INPUT);
        expected = "cell 1";
    }
    SECTION("coordinate") {
        grid.positions[5] = std::numeric_limits<double>::quiet_NaN();
        CHECK(optimize() == HEXOPT_BAD_INPUT);
        grid.positions[5] = input[5];
        expected = "vertex 1";
    }
    SECTION("null array") {
        mesh.cells = nullptr;
        CHECK(optimize() == HEXOPT_USAGE);
        expected = "cells is NULL";
    }
    SECTION("impossible count") {
        mesh.vertex_count = std::size_t{1} << 40;
        CHECK(optimize() == HEXOPT_USAGE);
        expected = "positions";
    }
    SECTION("no cells") {
        mesh.cell_count = 0;
        CHECK(optimize() == HEXOPT_BAD_INPUT);
        expected = "no hexahedra";
    }
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains(expected));
    CHECK(grid.positions == input);
}

TEST_CASE("options out of range are refused by name") {
    const ContextPointer context = make_context();
    Grid grid(2);
    hexopt_mesh mesh = view(grid);
    hexopt_optimize_options options = HEXOPT_OPTIMIZE_OPTIONS_INIT;
    std::string expected;
    SECTION("boundary") { options.boundary = static_cast<hexopt_boundary>(7), expected = "boundary"; }
    SECTION("feature angle") { options.feature_angle_deg = 181, expected = "feature_angle_deg"; }
    SECTION("deviation") { options.max_deviation_rel = -1, expected = "max_deviation_rel"; }
    SECTION("reach") { options.feature_reach_rel = 0.02, expected = "feature_reach_rel"; }
    SECTION("starts") { options.starts = 5, expected = "starts"; }
    SECTION("lines") { options.feature_segment_count = 1, expected = "feature_segments is NULL"; }
    SECTION("nan") { options.min_sj = std::numeric_limits<double>::quiet_NaN(), expected = "min_sj"; }
    SECTION("time") { options.time_limit_s = -1, expected = "time_limit_s"; }
    SECTION("iterations") { options.max_iterations = 0, expected = "max_iterations"; }
    SECTION("newer version") { options.version = HEXOPT_VERSION + 1, expected = "version"; }
    SECTION("larger struct") { options.struct_size += 8, expected = "struct_size"; }
    SECTION("no size") { options.struct_size = 0, expected = "struct_size"; }
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, &options, nullptr) == HEXOPT_USAGE);
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains(expected));
}

TEST_CASE("a program with older, shorter structs gets defaults for the rest, and nothing beyond their end") {
    const ContextPointer context = make_context();
    Grid grid(4);
    grid.tangle();
    hexopt_mesh mesh = view(grid);
    hexopt_optimize_options options = fixed_boundary();
    options.struct_size = offsetof(hexopt_optimize_options, max_deviation_rel);
    options.max_deviation_rel = 1e9; // beyond what the program of this size knows
    options.max_iterations = -1;
    hexopt_optimize_result result;
    std::memset(&result, 0x5a, sizeof result);
    result.struct_size = offsetof(hexopt_optimize_result, min_sj_before);
    result.version = HEXOPT_VERSION;
    REQUIRE(hexopt_optimize(context.get(), &mesh, nullptr, &options, &result) == HEXOPT_OK);
    CHECK(result.concave32_before > 0);
    unsigned char untouched[sizeof result.seconds];
    std::memset(untouched, 0x5a, sizeof untouched);
    CHECK(std::memcmp(&result.seconds, untouched, sizeof untouched) == 0);
}

TEST_CASE("vertices slide along feature segments, which must follow the mesh's edges") {
    const ContextPointer context = make_context();
    Grid grid(4);
    for (std::size_t v = 0; v < grid.positions.size(); v += 3)
        if (grid.positions[v] == 2) grid.positions[v] = 2.6; // the plane in the middle, off it
    grid.tangle();
    hexopt_mesh mesh = view(grid);
    const std::vector<double> input = grid.positions;
    const std::vector<double> segments{2.6, 0, 4, 2.6, 4, 4, 1, 1, 1, 1, 1, 1};
    const auto middle = 3 * grid.vertex(2, 2, 4);
    for (const bool with_lines : {false, true}) {
        grid.positions = input;
        mesh.positions = grid.positions.data();
        hexopt_optimize_options options = HEXOPT_OPTIMIZE_OPTIONS_INIT;
        options.feature_segment_count = with_lines ? 2 : 0; // the second one has no length
        options.feature_segments = segments.data();
        REQUIRE(hexopt_optimize(context.get(), &mesh, nullptr, &options, nullptr) == HEXOPT_OK);
        if (with_lines)
            CHECK(grid.positions[middle] == Approx(2.6).margin(1e-12));
        else
            CHECK(grid.positions[middle] < 2.3);
    }
    hexopt_optimize_options options = HEXOPT_OPTIMIZE_OPTIONS_INIT;
    std::vector<double> other{2, 0, 4, 2, 4, 4};
    options.feature_segment_count = 1;
    options.feature_segments = other.data();
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, &options, nullptr) == HEXOPT_BAD_INPUT);
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains("(2, 0, 4)"));
    other[4] = std::numeric_limits<double>::infinity();
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, &options, nullptr) == HEXOPT_BAD_INPUT);
    CHECK_THAT(hexopt_context_message(context.get()), Catch::Contains("feature segment 0"));
    options.boundary = HEXOPT_BOUNDARY_FIXED; // where it has no effect
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, &options, nullptr) == HEXOPT_OK);
}

TEST_CASE("a null context, null outputs and null meshes are usage errors") {
    const ContextPointer context = make_context();
    Grid grid(2);
    hexopt_mesh mesh = view(grid);
    hexopt_quality quality = HEXOPT_QUALITY_INIT;
    CHECK(hexopt_context_create(nullptr, nullptr) == HEXOPT_USAGE);
    CHECK(hexopt_measure(nullptr, &mesh, &quality) == HEXOPT_USAGE);
    CHECK(hexopt_measure(context.get(), &mesh, nullptr) == HEXOPT_USAGE);
    CHECK(hexopt_measure(context.get(), nullptr, &quality) == HEXOPT_USAGE);
    CHECK(hexopt_optimize(context.get(), nullptr, nullptr, nullptr, nullptr) == HEXOPT_USAGE);
    hexopt_context_cancel(nullptr);
    hexopt_context_destroy(nullptr);
}

TEST_CASE("a progress callback that returns 1 cancels that call and no later one") {
    struct Watch {
        bool cancel = true;
        double last = 0;
        bool falls = false;
    } watch;
    hexopt_context_options context_options = HEXOPT_CONTEXT_OPTIONS_INIT;
    context_options.user = &watch;
    context_options.progress = [](void* user, const char*, double fraction, const char*) {
        Watch& w = *static_cast<Watch*>(user);
        w.falls = w.falls || fraction < w.last;
        w.last = fraction;
        return w.cancel && fraction > 0 ? 1 : 0;
    };
    const ContextPointer context = make_context(&context_options);
    Grid grid(4);
    grid.tangle();
    hexopt_mesh mesh = view(grid);
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, nullptr, nullptr) == HEXOPT_CANCELLED);
    watch = {false, 0, false};
    hexopt_context_cancel(context.get());
    CHECK(hexopt_optimize(context.get(), &mesh, nullptr, nullptr, nullptr) == HEXOPT_OK);
    CHECK_FALSE(watch.falls);
    CHECK(watch.last == 1);
}

TEST_CASE("two contexts in two threads give the same bits as one") {
    const auto run = [](std::vector<double>& positions, hexopt_status& status) {
        Grid grid(6);
        grid.tangle();
        hexopt_context* context = nullptr;
        status = hexopt_context_create(nullptr, &context);
        if (status != HEXOPT_OK) return;
        hexopt_mesh mesh = view(grid);
        const hexopt_optimize_options options = fixed_boundary();
        for (int repeat = 0; repeat < 3 && status == HEXOPT_OK; ++repeat)
            status = hexopt_optimize(context, &mesh, nullptr, &options, nullptr);
        hexopt_context_destroy(context);
        positions = grid.positions;
    };
    std::vector<double> alone, first, second;
    hexopt_status status[3];
    run(alone, status[0]);
    std::thread one([&] { run(first, status[1]); });
    std::thread two([&] { run(second, status[2]); });
    one.join();
    two.join();
    for (const hexopt_status s : status) CHECK(s == HEXOPT_OK);
    CHECK(first == alone);
    CHECK(second == alone);
}

TEST_CASE("names and versions") {
    CHECK(hexopt_interface_version() == HEXOPT_VERSION);
    CHECK(std::string(hexopt_status_name(HEXOPT_BELOW_TARGET)) == "below_target");
    CHECK(std::string(hexopt_status_name(static_cast<hexopt_status>(77))) == "unknown");
}
