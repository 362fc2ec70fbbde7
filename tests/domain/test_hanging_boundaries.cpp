#include "domain/deviation.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

struct Case {
    HexMesh mesh;
    Topology topology;
    BoundaryModel model;
};

Case make(std::string_view name) {
    Context context(1);
    Result<HexMesh> mesh = make_sample(name, {}, context);
    if (!mesh) FAIL(mesh.error().one_line());
    Topology topology = compute_topology(*mesh);
    Result<BoundaryModel> model = build_boundary_model(*mesh, topology, {}, context);
    if (!model) FAIL(model.error().one_line());
    return {std::move(*mesh), std::move(topology), std::move(*model)};
}

} // namespace

TEST_CASE("hanging vertices open no gaps: a refined cube has the features of a cube") {
    for (const char* name : {"octree-corner", "octree-sphere"}) {
        INFO(name);
        const Case c = make(name);
        CHECK(c.model.patch_count() == 6);
        CHECK(c.model.curve_count() == 12);
        CHECK(c.model.corner_count() == 8);
        // Hanging vertices on the cube's edges are points of the curves all the same.
        double length = 0;
        for (Index s = 0; s < c.model.segment_count(); ++s)
            length += glm::length(c.model.segment(s)[1] - c.model.segment(s)[0]);
        CHECK(length == Approx(12 * c.model.diagonal() / std::sqrt(3.0)));
    }
}

TEST_CASE("on octree meshes hanging vertices stay constrained, the others lie on what they are bound to") {
    for (const char* name : {"octree-corner", "octree-sphere", "octree-warped", "octree-ball",
                             "octree-trimmed", "octree-halved"}) {
        INFO(name);
        const Case c = make(name);
        std::size_t hanging_boundary = 0;
        for (Index v = 0; v < c.mesh.vertex_count(); ++v) {
            const Association a = c.model.associations()[v];
            const bool hangs = c.topology.hanging_row[v] != kNoIndex;
            CHECK((a.kind == EntityKind::hanging) == hangs);
            if (hangs) {
                hanging_boundary += c.topology.on_boundary[v];
                continue;
            }
            CHECK((a.kind == EntityKind::interior) == (c.topology.on_boundary[v] == 0));
            CHECK(c.model.project(a, c.mesh.positions[v]).distance <= 1e-12 * c.model.diagonal());
        }
        CAPTURE(hanging_boundary);
        Context context(1);
        const Result<Deviation> d = measure_deviation(c.mesh, c.topology, c.model, {}, context);
        REQUIRE(d);
        CHECK(d->largest() == 0);
        CHECK(d->feature_largest() == 0);
        // No open edge may turn into a feature: each would have a single patch of the model beside it.
        if (std::string_view(name) == "octree-warped") CHECK(c.model.patch_count() == 6);
    }
}

TEST_CASE("without its constraints the same boundary has open edges, which become features") {
    Case c = make("octree-corner");
    const std::size_t with = c.model.curve_count();
    c.mesh.hanging.clear();
    ++c.mesh.revision;
    Context context(1);
    const Result<BoundaryModel> open = build_boundary_model(c.mesh, compute_topology(c.mesh), {}, context);
    REQUIRE(open);
    CHECK(open->curve_count() > with);
}
