#pragma once

#include "compute/vulkan/vulkan_api.hpp"

namespace hexopt::compute::testing {

/// A host application's own Vulkan: instance, device, queue and one buffer.
struct HostApplication {
    InstanceApi instance_api;
    DeviceApi api;
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    PFN_vkGetInstanceProcAddr get = nullptr;

    bool open(std::size_t bytes) {
        const auto loader = load_vulkan();
        if (!loader) return false;
        get = loader->get;
        const auto create = reinterpret_cast<PFN_vkCreateInstance>(get(nullptr, "vkCreateInstance"));
        VkApplicationInfo application{};
        application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
        application.apiVersion = VK_API_VERSION_1_2;
        VkInstanceCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
        info.pApplicationInfo = &application;
        if (create(&info, nullptr, &instance) != VK_SUCCESS || !instance_api.load(get, instance))
            return false;
        std::uint32_t count = 1;
        instance_api.vkEnumeratePhysicalDevices(instance, &count, &physical);
        return count > 0 && open_device() && make_buffer(bytes);
    }

    bool open_device() {
        VkPhysicalDeviceVulkan12Features v12{};
        v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
        v12.bufferDeviceAddress = v12.scalarBlockLayout = v12.timelineSemaphore = VK_TRUE;
        VkPhysicalDeviceFeatures2 features{};
        features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
        features.pNext = &v12;
        features.features.shaderFloat64 = VK_TRUE;
        const float priority = 1;
        VkDeviceQueueCreateInfo queue_info{};
        queue_info.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
        queue_info.queueCount = 1;
        queue_info.pQueuePriorities = &priority;
        VkDeviceCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
        info.pNext = &features;
        info.queueCreateInfoCount = 1;
        info.pQueueCreateInfos = &queue_info;
        if (instance_api.vkCreateDevice(physical, &info, nullptr, &device) != VK_SUCCESS) return false;
        if (!api.load(instance_api, device)) return false;
        api.vkGetDeviceQueue(device, 0, 0, &queue);
        return true;
    }

    bool make_buffer(std::size_t bytes) {
        VkBufferCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
        info.size = bytes;
        info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                     VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
        if (api.vkCreateBuffer(device, &info, nullptr, &buffer) != VK_SUCCESS) return false;
        VkMemoryRequirements requirements;
        api.vkGetBufferMemoryRequirements(device, buffer, &requirements);
        VkMemoryAllocateFlagsInfo flags{};
        flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
        flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
        VkMemoryAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
        allocate.pNext = &flags;
        allocate.allocationSize = requirements.size;
        for (allocate.memoryTypeIndex = 0; !(requirements.memoryTypeBits >> allocate.memoryTypeIndex & 1);)
            ++allocate.memoryTypeIndex;
        return api.vkAllocateMemory(device, &allocate, nullptr, &memory) == VK_SUCCESS &&
               api.vkBindBufferMemory(device, buffer, memory, 0) == VK_SUCCESS;
    }

    ~HostApplication() {
        if (device && api.vkDestroyDevice) {
            api.vkDestroyBuffer(device, buffer, nullptr);
            api.vkFreeMemory(device, memory, nullptr);
            api.vkDestroyDevice(device, nullptr);
        }
        if (instance) instance_api.vkDestroyInstance(instance, nullptr);
    }
};

} // namespace hexopt::compute::testing
