#pragma once

#include "capi/context.hpp"
#include "compute/backend.hpp"

#include <memory>
#include <vector>

namespace hexopt::capi {

/// A mesh in a host application's device memory, copied to the host.
class DeviceMesh {
  public:
    DeviceMesh(std::unique_ptr<compute::Backend> backend, const hexopt_device_mesh& given)
        : backend_(std::move(backend)), given_(given) {}

    /// Copies positions and cells from the device.
    Status load();
    /// Copies positions back to the device.
    Status store_positions();

    compute::Backend& backend() { return *backend_; }
    /// The copy; its positions may be written to.
    hexopt_mesh view();

  private:
    std::size_t positions_bytes() const {
        return positions_.size() * (given_.positions_are_f32 ? sizeof(float) : sizeof(double));
    }

    std::unique_ptr<compute::Backend> backend_;
    hexopt_device_mesh given_;
    std::vector<double> positions_;
    std::vector<std::uint32_t> cells_;
};

/// Adopts the application's device and copies the mesh. Errors: usage (structs, null handles, sizes), device,
/// out_of_memory.
Result<DeviceMesh> open_device_mesh(const hexopt_vulkan* vulkan, const hexopt_device_mesh* mesh);

} // namespace hexopt::capi
