#pragma once

#include "core/result.hpp"

#define VK_NO_PROTOTYPES
#include <memory>
#include <vulkan/vulkan_core.h>

/// Vulkan's functions, loaded at run time so that machines without libvulkan still run on the CPU.
namespace hexopt::compute {

#define HEXOPT_VK_INSTANCE_FUNCTIONS(X)                                                                      \
    X(vkDestroyInstance)                                                                                     \
    X(vkEnumeratePhysicalDevices)                                                                            \
    X(vkGetPhysicalDeviceProperties2)                                                                        \
    X(vkGetPhysicalDeviceFeatures2)                                                                          \
    X(vkGetPhysicalDeviceMemoryProperties)                                                                   \
    X(vkGetPhysicalDeviceQueueFamilyProperties)                                                              \
    X(vkCreateDevice)                                                                                        \
    X(vkGetDeviceProcAddr)

#define HEXOPT_VK_DEVICE_FUNCTIONS(X)                                                                        \
    X(vkDestroyDevice)                                                                                       \
    X(vkDeviceWaitIdle)                                                                                      \
    X(vkGetDeviceQueue)                                                                                      \
    X(vkQueueSubmit)                                                                                         \
    X(vkCreateBuffer)                                                                                        \
    X(vkDestroyBuffer)                                                                                       \
    X(vkGetBufferMemoryRequirements)                                                                         \
    X(vkGetBufferDeviceAddress)                                                                              \
    X(vkBindBufferMemory)                                                                                    \
    X(vkAllocateMemory)                                                                                      \
    X(vkFreeMemory)                                                                                          \
    X(vkMapMemory)                                                                                           \
    X(vkCreateShaderModule)                                                                                  \
    X(vkDestroyShaderModule)                                                                                 \
    X(vkCreatePipelineLayout)                                                                                \
    X(vkDestroyPipelineLayout)                                                                               \
    X(vkCreatePipelineCache)                                                                                 \
    X(vkDestroyPipelineCache)                                                                                \
    X(vkGetPipelineCacheData)                                                                                \
    X(vkCreateComputePipelines)                                                                              \
    X(vkDestroyPipeline)                                                                                     \
    X(vkCreateCommandPool)                                                                                   \
    X(vkDestroyCommandPool)                                                                                  \
    X(vkAllocateCommandBuffers)                                                                              \
    X(vkBeginCommandBuffer)                                                                                  \
    X(vkEndCommandBuffer)                                                                                    \
    X(vkCmdBindPipeline)                                                                                     \
    X(vkCmdPushConstants)                                                                                    \
    X(vkCmdDispatch)                                                                                         \
    X(vkCmdCopyBuffer)                                                                                       \
    X(vkCmdFillBuffer)                                                                                       \
    X(vkCmdPipelineBarrier)                                                                                  \
    X(vkCreateSemaphore)                                                                                     \
    X(vkDestroySemaphore)                                                                                    \
    X(vkWaitSemaphores)

struct InstanceApi {
    PFN_vkGetInstanceProcAddr vkGetInstanceProcAddr = nullptr;
#define X(name) PFN_##name name = nullptr;
    HEXOPT_VK_INSTANCE_FUNCTIONS(X)
#undef X
    /// False where a function is missing.
    bool load(PFN_vkGetInstanceProcAddr get, VkInstance instance);
};

struct DeviceApi {
#define X(name) PFN_##name name = nullptr;
    HEXOPT_VK_DEVICE_FUNCTIONS(X)
#undef X
    bool load(const InstanceApi& api, VkDevice device);
};

struct VulkanLoader {
    PFN_vkGetInstanceProcAddr get;
};

/// libvulkan, loaded once a process and never unloaded (drivers leave threads behind). Error: device.
Result<VulkanLoader> load_vulkan();

/// "vkCreateDevice: VK_ERROR_..." as an Error of the right code.
Error vulkan_error(VkResult result, const char* call);

} // namespace hexopt::compute
