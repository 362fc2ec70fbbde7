#include <catch2/catch.hpp>
#include <hexopt/hexopt.hpp>

#include <memory>
#include <set>
#include <stdexcept>

namespace {

/// A box of sides 1, 1 and 2 whose sides are patches 100, 101, ...
struct BoxSurface {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles, patch;

    BoxSurface() {
        constexpr std::uint32_t kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
        for (int i = 0; i < 8; ++i)
            for (int k = 0; k < 3; ++k) positions.push_back((i >> k & 1) * (k == 2 ? 2.0 : 1.0));
        for (std::uint32_t s = 0; s < 6; ++s)
            for (int half = 0; half < 2; ++half) {
                triangles.insert(triangles.end(), {kSides[s][0], kSides[s][1 + half], kSides[s][2 + half]});
                patch.push_back(100 + s);
            }
    }
    hexopt_surface view() const {
        hexopt_surface surface = HEXOPT_SURFACE_INIT;
        surface.vertex_count = positions.size() / 3;
        surface.positions = positions.data();
        surface.triangle_count = triangles.size() / 3;
        surface.triangles = triangles.data();
        surface.triangle_patch = patch.data();
        return surface;
    }
};

struct Made {
    hexopt_status status;
    std::string message;
    std::unique_ptr<hexopt_volume, decltype(&hexopt_volume_destroy)> volume{nullptr, &hexopt_volume_destroy};
    hexopt_mesh_result result = HEXOPT_MESH_RESULT_INIT;
};

Made mesh(const hexopt_surface* surface, const char* config,
          const hexopt_context_options* options = nullptr) {
    hexopt_context* context = nullptr;
    REQUIRE(hexopt_context_create(options, &context) == HEXOPT_OK);
    Made made;
    auto* volume = reinterpret_cast<hexopt_volume*>(1);
    made.status = hexopt_mesh_surface(context, surface, config, &volume, &made.result);
    made.volume.reset(volume);
    made.message = hexopt_context_message(context);
    hexopt_context_destroy(context);
    return made;
}

} // namespace

TEST_CASE("a surface in the caller's arrays is meshed, with its patches") {
    const BoxSurface box;
    const hexopt_surface surface = box.view();
    const Made made = mesh(&surface, "[refine]\ncells = 1000\n");
    REQUIRE(made.status == HEXOPT_OK);
    REQUIRE(made.volume);
    const hexopt_mesh arrays = hexopt_volume_mesh(made.volume.get());
    CHECK(made.result.cells == arrays.cell_count);
    CHECK(made.result.vertices == arrays.vertex_count);
    CHECK(arrays.cell_count > 300);
    CHECK(made.result.invalid + made.result.concave32 + made.result.contacts == 0);
    CHECK(made.result.curves == 12);
    CHECK(made.result.curves_captured == 12);
    CHECK(made.result.max_deviation < 1e-9);
    std::set<std::string> names;
    for (std::uint32_t p = 0; p < hexopt_volume_patch_count(made.volume.get()); ++p)
        names.insert(hexopt_volume_patch_name(made.volume.get(), p));
    CHECK(names == std::set<std::string>{"100", "101", "102", "103", "104", "105"});
    CHECK(hexopt_volume_patch_name(made.volume.get(), 6) == nullptr);
    REQUIRE(hexopt_volume_level(made.volume.get()) != nullptr);
    for (std::size_t q = 0; q < arrays.patch_quad_count; ++q) {
        REQUIRE(arrays.quad_patch[q] < 6);
        const std::string name = hexopt_volume_patch_name(made.volume.get(), arrays.quad_patch[q]);
        if (name != "105") continue; // z = 2
        for (int k = 0; k < 4; ++k)
            CHECK(arrays.positions[3 * arrays.patch_quads[4 * q + static_cast<std::size_t>(k)] + 2] ==
                  Approx(2));
    }

    hexopt_context* context = nullptr;
    REQUIRE(hexopt_context_create(nullptr, &context) == HEXOPT_OK);
    hexopt_quality quality = HEXOPT_QUALITY_INIT;
    CHECK(hexopt_measure(context, &arrays, &quality) == HEXOPT_OK);
    CHECK(quality.valid == arrays.cell_count);
    CHECK(quality.min_sj == made.result.min_sj);
    hexopt_context_destroy(context);
}

TEST_CASE("what cannot be meshed in memory is refused, and leaves no volume") {
    const BoxSurface box;
    const hexopt_surface surface = box.view();
    const auto refused = [&](const hexopt_surface* given, const char* config, hexopt_status status,
                             const std::string& words) {
        const Made made = mesh(given, config);
        INFO(made.message);
        CHECK(made.status == status);
        CHECK(!made.volume);
        CHECK(made.message.find(words) != std::string::npos);
    };
    refused(nullptr, nullptr, HEXOPT_USAGE, "hexopt_surface");
    refused(&surface, "[refine]\ncels = 5\n", HEXOPT_USAGE, "config:2");
    refused(&surface, "[refine\n", HEXOPT_BAD_INPUT, "config:1");
    refused(&surface, "[refine]\nmax_cells = 1\n", HEXOPT_USAGE, "refine.max_cells");
    refused(&surface, "[refine]\ninitial_mesh = 'a.vtu'\n", HEXOPT_USAGE, "refine.initial_mesh");
    refused(&surface, "[features]\nlines = ['a.obj']\n", HEXOPT_USAGE, "features.lines");
    BoxSurface damaged;
    damaged.triangles[4] = 99;
    const hexopt_surface bad = damaged.view();
    refused(&bad, nullptr, HEXOPT_BAD_INPUT, "triangle 1");
    hexopt_surface empty = surface;
    empty.triangle_count = 0;
    refused(&empty, nullptr, HEXOPT_BAD_INPUT, "");

    hexopt_context* context = nullptr;
    REQUIRE(hexopt_context_create(nullptr, &context) == HEXOPT_OK);
    CHECK(hexopt_mesh_surface(context, &surface, nullptr, nullptr, nullptr) == HEXOPT_USAGE);
    hexopt_volume* volume = nullptr;
    hexopt_mesh_result newer = HEXOPT_MESH_RESULT_INIT;
    newer.version = HEXOPT_VERSION + 1;
    CHECK(hexopt_mesh_surface(context, &surface, nullptr, &volume, &newer) == HEXOPT_USAGE);
    CHECK(volume == nullptr);
    CHECK(hexopt_mesh_surface(nullptr, &surface, nullptr, &volume, nullptr) == HEXOPT_USAGE);
    hexopt_context_destroy(context);
    hexopt_volume_destroy(nullptr);
    CHECK(hexopt_volume_mesh(nullptr).cell_count == 0);
    CHECK(hexopt_volume_patch_count(nullptr) == 0);
}

TEST_CASE("meshing is cancelled by its progress, and what that throws comes back") {
    const BoxSurface box;
    const hexopt_surface surface = box.view();
    hexopt_context_options options = HEXOPT_CONTEXT_OPTIONS_INIT;
    options.progress = [](void*, const char* stage, double, const char*) -> int {
        return std::string(stage) == "trim";
    };
    const Made made = mesh(&surface, "[refine]\ncells = 1000\n", &options);
    CHECK(made.status == HEXOPT_CANCELLED);
    CHECK(!made.volume);

    const hexopt::Surface arrays{box.positions, box.triangles, box.patch};
    hexopt::Optimizer thrower({.progress = [](std::string_view, double, std::string_view) -> bool {
        throw std::runtime_error("no");
    }});
    CHECK_THROWS_WITH(thrower.mesh(arrays), "no");
    hexopt::Optimizer optimizer;
    CHECK_THROWS_AS(optimizer.mesh(arrays, "[refine]\ncels = 5\n"), hexopt::Failure);
    const hexopt::MeshResult result = optimizer.mesh(arrays, "[refine]\ncells = 1000\n");
    CHECK(result.status == HEXOPT_OK);
    CHECK(result.volume.cells.size() == 8 * result.cells);
    CHECK(result.volume.patch_names.size() == 6);
}
