#include "capi/device_mesh.hpp"

#include "compute/vulkan/vulkan_backend.hpp"
#include "core/types.hpp"

#include <span>

namespace hexopt::capi {

namespace {

Result<compute::VulkanOptions> read_vulkan(const hexopt_vulkan* given) {
    if (!given) return usage_error("hexopt_vulkan", "is NULL");
    hexopt_vulkan vulkan = HEXOPT_VULKAN_INIT;
    if (auto status = read_struct(given, "hexopt_vulkan", vulkan); !status) return status.error();
    if (!vulkan.get_instance_proc_addr || !vulkan.instance || !vulkan.physical_device || !vulkan.device ||
        !vulkan.queue)
        return usage_error("hexopt_vulkan", "a handle is NULL");
    if (!vulkan.lock != !vulkan.unlock)
        return usage_error("hexopt_vulkan", "lock and unlock belong together");
    compute::VulkanOptions options;
    compute::ExternalVulkan& external = options.external;
    external.get_instance_proc_addr = vulkan.get_instance_proc_addr;
    external.instance = vulkan.instance;
    external.physical_device = vulkan.physical_device;
    external.device = vulkan.device;
    external.queue = vulkan.queue;
    external.queue_family = vulkan.queue_family;
    external.f64 = vulkan.f64 != 0;
    if (vulkan.lock) {
        external.lock = [lock = vulkan.lock, user = vulkan.user] { lock(user); };
        external.unlock = [unlock = vulkan.unlock, user = vulkan.user] { unlock(user); };
    }
    return options;
}

Status check(const hexopt_device_mesh& mesh) {
    if (!mesh.positions || !mesh.cells) return usage_error("hexopt_device_mesh", "a buffer is NULL");
    if (mesh.vertex_count >= kNoIndex || mesh.cell_count >= kNoIndex)
        return usage_error("hexopt_device_mesh", "more than 2^32 - 2 vertices or cells");
    if (mesh.positions_offset % 4 != 0 || mesh.cells_offset % 4 != 0)
        return usage_error("hexopt_device_mesh", "an offset is not a multiple of 4");
    return Done{};
}

/// Copies between the host and a range of a buffer of the application.
template <class T>
Status load_range(compute::Backend& backend, void* buffer, std::uint64_t offset, std::span<T> target) {
    auto imported = backend.import_buffer(buffer, offset + target.size_bytes());
    if (!imported) return imported.error();
    return backend.download(*imported, offset, std::as_writable_bytes(target));
}

template <class T>
Status store_range(compute::Backend& backend, void* buffer, std::uint64_t offset, std::span<const T> source) {
    auto imported = backend.import_buffer(buffer, offset + source.size_bytes());
    if (!imported) return imported.error();
    return backend.upload(*imported, offset, std::as_bytes(source));
}

} // namespace

Status DeviceMesh::load() {
    positions_.resize(3 * given_.vertex_count);
    cells_.resize(8 * given_.cell_count);
    if (positions_.empty() || cells_.empty()) return Done{};
    if (given_.positions_are_f32) {
        std::vector<float> single(positions_.size());
        if (auto status = load_range(*backend_, given_.positions, given_.positions_offset, std::span(single));
            !status)
            return status;
        positions_.assign(single.begin(), single.end());
    } else if (auto status =
                   load_range(*backend_, given_.positions, given_.positions_offset, std::span(positions_));
               !status) {
        return status;
    }
    return load_range(*backend_, given_.cells, given_.cells_offset, std::span(cells_));
}

Status DeviceMesh::store_positions() {
    if (!given_.positions_are_f32)
        return store_range(*backend_, given_.positions, given_.positions_offset,
                           std::span<const double>(positions_));
    const std::vector<float> single(positions_.begin(), positions_.end());
    return store_range(*backend_, given_.positions, given_.positions_offset, std::span(single));
}

hexopt_mesh DeviceMesh::view() {
    hexopt_mesh mesh = HEXOPT_MESH_INIT;
    mesh.vertex_count = given_.vertex_count;
    mesh.positions = positions_.data();
    mesh.cell_count = given_.cell_count;
    mesh.cells = cells_.data();
    mesh.hanging_count = given_.hanging_count;
    mesh.hanging_vertex = given_.hanging_vertex;
    mesh.hanging_offset = given_.hanging_offset;
    mesh.hanging_master = given_.hanging_master;
    mesh.hanging_weight = given_.hanging_weight;
    return mesh;
}

Result<DeviceMesh> open_device_mesh(const hexopt_vulkan* vulkan, const hexopt_device_mesh* mesh) {
    if (!mesh) return usage_error("hexopt_device_mesh", "is NULL");
    hexopt_device_mesh known = HEXOPT_DEVICE_MESH_INIT;
    if (auto status = read_struct(mesh, "hexopt_device_mesh", known); !status) return status.error();
    if (auto status = check(known); !status) return status.error();
    const Result<compute::VulkanOptions> options = read_vulkan(vulkan);
    if (!options) return options.error();
    auto backend = compute::create_vulkan_backend(*options);
    if (!backend) return backend.error();
    DeviceMesh opened(std::move(*backend), known);
    if (auto status = opened.load(); !status) return status.error();
    return opened;
}

} // namespace hexopt::capi
