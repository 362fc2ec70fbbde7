#include "capi/grid.hpp"
#include "compute/host_application.hpp"
#include "compute/vulkan/vulkan_backend.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <hexopt/hexopt.h>

#include <memory>

using namespace hexopt::compute;
using hexopt::compute::testing::HostApplication;

namespace {

constexpr std::size_t kPositionsOffset = 256;

struct Locks {
    int held = 0, taken = 0;
};

/// The application's own access to its buffer, through a second backend on the same device.
struct HostBuffer {
    std::unique_ptr<VulkanBackend> backend;
    Buffer buffer;

    HostBuffer(HostApplication& host, std::size_t bytes) {
        VulkanOptions options;
        options.external.get_instance_proc_addr = reinterpret_cast<void*>(host.get);
        options.external.instance = host.instance;
        options.external.physical_device = host.physical;
        options.external.device = host.device;
        options.external.queue = host.queue;
        options.external.f64 = true;
        auto created = create_vulkan_backend(options);
        REQUIRE(created);
        backend = std::move(*created);
        auto imported = backend->import_buffer(host.buffer, bytes);
        REQUIRE(imported);
        buffer = std::move(*imported);
    }
};

template <class Real>
void optimize_in_host_memory() {
    Grid grid(4);
    grid.tangle();
    const std::vector<Real> input(grid.positions.begin(), grid.positions.end());
    const std::size_t cells_offset = kPositionsOffset + input.size() * sizeof(Real);
    const std::size_t bytes = cells_offset + grid.cells.size() * sizeof(std::uint32_t);
    HostApplication host;
    if (!host.open(bytes)) HEXOPT_SKIP("no Vulkan device");
    HostBuffer memory(host, bytes);
    REQUIRE(memory.backend->upload(memory.buffer, kPositionsOffset, std::as_bytes(std::span(input))));
    REQUIRE(memory.backend->upload(memory.buffer, cells_offset, std::as_bytes(std::span(grid.cells))));

    Locks locks;
    hexopt_vulkan vulkan = HEXOPT_VULKAN_INIT;
    vulkan.get_instance_proc_addr = reinterpret_cast<void*>(host.get);
    vulkan.instance = host.instance;
    vulkan.physical_device = host.physical;
    vulkan.device = host.device;
    vulkan.queue = host.queue;
    vulkan.f64 = 1;
    vulkan.user = &locks;
    vulkan.lock = [](void* user) { ++static_cast<Locks*>(user)->held, ++static_cast<Locks*>(user)->taken; };
    vulkan.unlock = [](void* user) { --static_cast<Locks*>(user)->held; };
    hexopt_device_mesh mesh = HEXOPT_DEVICE_MESH_INIT;
    mesh.vertex_count = grid.positions.size() / 3;
    mesh.positions = host.buffer;
    mesh.positions_offset = kPositionsOffset;
    mesh.positions_are_f32 = sizeof(Real) == sizeof(float);
    mesh.cell_count = grid.cells.size() / 8;
    mesh.cells = host.buffer;
    mesh.cells_offset = cells_offset;

    hexopt_context* context = nullptr;
    REQUIRE(hexopt_context_create(nullptr, &context) == HEXOPT_OK);
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    const hexopt_status status = hexopt_optimize_on_device(context, &vulkan, &mesh, nullptr, &result);
    INFO(hexopt_context_message(context));
    CHECK(status == HEXOPT_OK);
    CHECK(result.concave32_before > 0);
    CHECK(result.concave32_after == 0);
    CHECK(locks.held == 0);
    CHECK(locks.taken > 0);

    std::vector<Real> output(input.size());
    REQUIRE(
        memory.backend->download(memory.buffer, kPositionsOffset, std::as_writable_bytes(std::span(output))));
    grid.positions.assign(output.begin(), output.end());
    hexopt_mesh view = HEXOPT_MESH_INIT;
    view.vertex_count = mesh.vertex_count;
    view.positions = grid.positions.data();
    view.cell_count = mesh.cell_count;
    view.cells = grid.cells.data();
    hexopt_quality quality = HEXOPT_QUALITY_INIT;
    REQUIRE(hexopt_measure(context, &view, &quality) == HEXOPT_OK);
    CHECK(quality.valid == 64);

    hexopt_optimize_options sliding = HEXOPT_OPTIMIZE_OPTIONS_INIT;
    CHECK(hexopt_optimize_on_device(context, &vulkan, &mesh, &sliding, nullptr) == HEXOPT_OK);
    vulkan.queue = nullptr;
    CHECK(hexopt_optimize_on_device(context, &vulkan, &mesh, nullptr, nullptr) == HEXOPT_USAGE);
    hexopt_context_destroy(context);
}

} // namespace

TEST_CASE("a host application's device optimizes double positions in its own buffer", "[gpu]") {
    optimize_in_host_memory<double>();
}

TEST_CASE("a host application's device optimizes float positions in its own buffer", "[gpu]") {
    optimize_in_host_memory<float>();
}
