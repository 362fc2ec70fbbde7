#pragma once

#include "compute/vulkan/vulkan_backend.hpp"

namespace hexopt::compute {

/// Where to run, and the sentence that tells the user why.
struct DeviceChoice {
    bool use_host = true; ///< the host's own vectorised code
    int index = -1;       ///< else this Vulkan device
    std::string reason;
};

/// request: "auto" (the best discrete, integrated or virtual GPU that can do it, else the host: a software
/// device computes the same on the same cores, slower), "cpu", "vulkan" (the best Vulkan device of any type),
/// a device's index or a part of its name. `absent`: why there is no list of devices, null where there is.
/// Errors: usage, for a request that names nothing or several; device, for one that names a device which
/// lacks what is needed.
Result<DeviceChoice> choose_device(const std::string& request, Precision precision,
                                   const std::vector<VulkanDeviceInfo>& devices, const Error* absent);

/// A backend, or none where the host's own code is to run.
struct OpenedDevice {
    std::unique_ptr<Backend> backend;
    DeviceChoice choice;
};

/// Lists the devices, chooses and opens. With "auto" a device that cannot be opened ends on the host, with
/// the reason in the choice; a device asked for by name is an error then.
Result<OpenedDevice> open_device(const std::string& request, Precision precision);

} // namespace hexopt::compute
