#pragma once

#include "compute/backend.hpp"

#include <functional>

namespace hexopt::compute {

/// What a host application lends: handles of Vulkan as void*. The device needs bufferDeviceAddress,
/// scalarBlockLayout and timelineSemaphore enabled (and shaderFloat64 for f64 and mixed), the queue's family
/// VK_QUEUE_COMPUTE_BIT. The queue is used only between lock() and unlock(), where those are given.
struct ExternalVulkan {
    void* get_instance_proc_addr = nullptr; ///< PFN_vkGetInstanceProcAddr
    void* instance = nullptr;
    void* physical_device = nullptr;
    void* device = nullptr;
    void* queue = nullptr;
    std::uint32_t queue_family = 0;
    bool f64 = false; ///< shaderFloat64 is enabled
    std::function<void()> lock, unlock;
};

struct VulkanOptions {
    int device_index = -1;      ///< as in list_vulkan_devices(); -1: the best by type
    bool validation = false;    ///< turns Khronos' validation layer on; an error where it is not installed
    std::string cache_folder;   ///< of the pipeline cache; empty: none is kept
    bool force_staging = false; ///< copies through a staging buffer even where memory is visible to the host
    Faults faults;
    ExternalVulkan external; ///< used where its device is set
};

/// One physical device as the loader enumerates it.
struct VulkanDeviceInfo {
    int index = 0;
    Capabilities capabilities;
    std::string
        missing; ///< what the kernels need and the device lacks, e.g. "scalarBlockLayout"; empty: usable
};

/// All physical devices. Errors: device, where there is no Vulkan loader or no driver.
Result<std::vector<VulkanDeviceInfo>> list_vulkan_devices();

/// A backend that also tells what the validation layer said.
class VulkanBackend : public Backend {
  public:
    /// Every warning and error of the validation layer so far.
    virtual std::vector<std::string> validation_messages() const = 0;
};

/// Opens a device. Errors: device, with the reason (no loader, no driver, missing feature, no such index).
Result<std::unique_ptr<VulkanBackend>> create_vulkan_backend(const VulkanOptions& options);

/// $XDG_CACHE_HOME/hexopt-gpu or ~/.cache/hexopt-gpu; empty where neither variable is set.
std::string default_cache_folder();

} // namespace hexopt::compute
