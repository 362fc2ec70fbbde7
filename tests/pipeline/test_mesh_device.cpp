#include "compute/device_choice.hpp"
#include "pipeline/mesh_surface.hpp"
#include "samples/geometry/geometries.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

Result<MeshOutcome> mesh_on(const ComputeRequest& request) {
    StageClock clock;
    Context context(2);
    const auto soup = make_geometry("cylinder", {24, ""}, context);
    REQUIRE(soup);
    MeshOptions options;
    options.refine.target_cells = 1500;
    options.optimize.min_sj = 0.95; // so that there is something to do
    options.refine.chord_error_rel =
        0; // creases are followed after the optimizer, at the cost of its minimum
    options.compute = request;
    return mesh_surface(*soup, options, clock, context);
}

void check_valid(const Result<MeshOutcome>& outcome) {
    INFO((outcome ? "" : outcome.error().one_line()));
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(outcome->after.validity.is_valid());
    CHECK(outcome->after.validity.min_scaled_jacobian > 0.3);
    CHECK(outcome->fit.captured_curves == outcome->curves);
}

} // namespace

TEST_CASE("meshes are optimized on the host unless told otherwise") {
    CHECK(MeshOptions().compute.device == "cpu"); // where there is a GPU too
    const auto host = mesh_on(MeshOptions().compute);
    check_valid(host);
    CHECK(host->device.find("cpu") == 0);
    const auto unknown = mesh_on({"teapot", compute::Precision::f64, nullptr});
    REQUIRE_FALSE(unknown);
    CHECK(unknown.error().code == ErrorCode::device);
    CHECK(unknown.error().one_line().find("teapot") != std::string::npos);
}

TEST_CASE("meshes may be optimized on a backend, and then its numbers count") {
    const auto host = mesh_on({});
    REQUIRE(host);
    const Parallel parallel(2);
    const auto backend = compute::create_cpu_backend(parallel);
    const auto own = mesh_on({"auto", compute::Precision::f64, backend.get()});
    check_valid(own);
    CHECK(own->device.find("given by the host application") != std::string::npos);
    const auto single = mesh_on({"cpu", compute::Precision::f32, nullptr});
    check_valid(single);
    CHECK(own->mesh.cells == host->mesh.cells);
    CHECK(own->mesh.positions != host->mesh.positions); // its kernels add in another order
    CHECK(single->mesh.positions != own->mesh.positions);
}

TEST_CASE("a mesh optimized on a device has the bits of the cpu backend", "[gpu]") {
    const auto opened = compute::open_device("vulkan", compute::Precision::f64);
    if (!opened) HEXOPT_SKIP(opened.error().one_line());
    const auto device = mesh_on({"vulkan", compute::Precision::f64, nullptr});
    check_valid(device);
    CHECK(device->device.find(opened->backend->capabilities().name) != std::string::npos);
    const Parallel parallel(2);
    const auto backend = compute::create_cpu_backend(parallel);
    const auto reference = mesh_on({"auto", compute::Precision::f64, backend.get()});
    check_valid(reference);
    if (opened->backend->capabilities().name.find("llvmpipe") != std::string::npos)
        CHECK(device->mesh.positions == reference->mesh.positions);
}
