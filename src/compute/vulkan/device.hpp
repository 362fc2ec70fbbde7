#pragma once

#include "compute/vulkan/vulkan_api.hpp"
#include "compute/vulkan/vulkan_backend.hpp"

#include <memory>
#include <mutex>

namespace hexopt::compute {

/// An instance, with the validation layer where asked for; destroyed with this unless it is the host's.
class VulkanInstance {
  public:
    static Result<std::unique_ptr<VulkanInstance>> create(bool validation);
    static Result<std::unique_ptr<VulkanInstance>> adopt(const ExternalVulkan& external);
    ~VulkanInstance();

    const InstanceApi& api() const { return api_; }
    VkInstance handle() const { return instance_; }
    std::vector<VkPhysicalDevice> physical_devices() const;
    std::vector<std::string> messages() const;

  private:
    void create_messenger();
    static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                     VkDebugUtilsMessageTypeFlagsEXT,
                                                     const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                     void* user);
    InstanceApi api_;
    VkInstance instance_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    bool owned_ = true;
    mutable std::mutex mutex_;
    std::vector<std::string> messages_;
};

/// What the kernels need to know of a physical device.
VulkanDeviceInfo describe(const InstanceApi& api, VkPhysicalDevice device, int index);

/// A logical device with one compute queue; destroyed with this unless it is the host's.
struct VulkanDevice {
    static Result<std::unique_ptr<VulkanDevice>> create(std::unique_ptr<VulkanInstance> instance,
                                                        const VulkanOptions& options);
    ~VulkanDevice();

    std::unique_ptr<VulkanInstance> instance;
    VulkanDeviceInfo info;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice handle = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::uint32_t queue_family = 0;
    VkPhysicalDeviceMemoryProperties memory{};
    VkPhysicalDeviceLimits limits{};
    DeviceApi api;
    std::function<void()> lock, unlock;
    bool owned = true;
};

} // namespace hexopt::compute
