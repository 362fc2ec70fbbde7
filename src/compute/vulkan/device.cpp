#include "compute/vulkan/device.hpp"

#include <algorithm>
#include <optional>

namespace hexopt::compute {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

DeviceType device_type(VkPhysicalDeviceType type) {
    switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return DeviceType::discrete_gpu;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return DeviceType::integrated_gpu;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return DeviceType::virtual_gpu;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return DeviceType::software_gpu;
    default:
        return DeviceType::other;
    }
}

std::optional<std::uint32_t> find_compute_family(const InstanceApi& api, VkPhysicalDevice device) {
    std::uint32_t count = 0;
    api.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    api.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    std::optional<std::uint32_t> found;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!(families[i].queueFlags & VK_QUEUE_COMPUTE_BIT)) continue;
        const bool dedicated = !(families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT);
        if (!found || dedicated) found = i;
        if (dedicated) break;
    }
    return found;
}

// The features the kernels use, chained for a query or for creation.
struct Features {
    VkPhysicalDeviceVulkan12Features v12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceFeatures2 base{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &v12};
};

Error no_device(std::string reason) {
    return make_error(ErrorCode::device, "compute", "vulkan", std::move(reason));
}

Result<VulkanDeviceInfo> choose_device(const VulkanInstance& instance, int index) {
    const auto devices = instance.physical_devices();
    if (devices.empty()) return no_device("no Vulkan driver found; install one, e.g. mesa-vulkan-drivers");
    if (index >= static_cast<int>(devices.size()))
        return no_device("no device " + std::to_string(index) + "; see `hexopt-gpu devices`");
    std::vector<VulkanDeviceInfo> infos;
    for (std::size_t i = 0; i < devices.size(); ++i)
        infos.push_back(describe(instance.api(), devices[i], static_cast<int>(i)));
    if (index >= 0) {
        if (infos[index].missing.empty()) return infos[index];
        return no_device(infos[index].capabilities.name + " lacks " + infos[index].missing);
    }
    std::stable_sort(infos.begin(), infos.end(), [](const auto& a, const auto& b) {
        if (a.missing.empty() != b.missing.empty()) return a.missing.empty();
        return a.capabilities.type < b.capabilities.type;
    });
    if (!infos.front().missing.empty())
        return no_device(infos.front().capabilities.name + " lacks " + infos.front().missing);
    return infos.front();
}

} // namespace

Result<std::unique_ptr<VulkanInstance>> VulkanInstance::create(bool validation) {
    auto loader = load_vulkan();
    if (!loader) return loader.error();
    const auto create_instance =
        reinterpret_cast<PFN_vkCreateInstance>(loader->get(nullptr, "vkCreateInstance"));
    if (!create_instance) return no_device("the Vulkan loader has no vkCreateInstance");
    VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.pApplicationName = "hexopt-gpu";
    application.apiVersion = VK_API_VERSION_1_2;
    const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pApplicationInfo = &application;
    const VkValidationFeatureEnableEXT enable = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT features{.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = &enable;
    if (validation) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kValidationLayer;
        info.enabledExtensionCount = 1;
        info.ppEnabledExtensionNames = &extension;
    }
    auto self = std::make_unique<VulkanInstance>();
    if (VkResult r = create_instance(&info, nullptr, &self->instance_); r != VK_SUCCESS)
        return vulkan_error(r, "vkCreateInstance");
    if (!self->api_.load(loader->get, self->instance_))
        return no_device("the Vulkan loader is older than 1.2");
    if (validation) self->create_messenger();
    return self;
}

Result<std::unique_ptr<VulkanInstance>> VulkanInstance::adopt(const ExternalVulkan& external) {
    auto self = std::make_unique<VulkanInstance>();
    self->instance_ = static_cast<VkInstance>(external.instance);
    self->owned_ = false;
    const auto get = reinterpret_cast<PFN_vkGetInstanceProcAddr>(external.get_instance_proc_addr);
    if (!get || !external.instance || !external.physical_device || !external.queue)
        return no_device("the host's Vulkan handles are incomplete");
    if (!self->api_.load(get, self->instance_)) return no_device("the host's Vulkan is older than 1.2");
    return self;
}

VulkanInstance::~VulkanInstance() {
    if (!owned_ || !instance_) return;
    if (messenger_) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            api_.vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
        if (destroy) destroy(instance_, messenger_, nullptr);
    }
    if (api_.vkDestroyInstance) api_.vkDestroyInstance(instance_, nullptr);
}

std::vector<VkPhysicalDevice> VulkanInstance::physical_devices() const {
    std::uint32_t count = 0;
    if (api_.vkEnumeratePhysicalDevices(instance_, &count, nullptr) != VK_SUCCESS) return {};
    std::vector<VkPhysicalDevice> devices(count);
    api_.vkEnumeratePhysicalDevices(instance_, &count, devices.data());
    devices.resize(count);
    return devices;
}

std::vector<std::string> VulkanInstance::messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
}

void VulkanInstance::create_messenger() {
    const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        api_.vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    if (!create) return;
    VkDebugUtilsMessengerCreateInfoEXT info{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    info.pfnUserCallback = on_message;
    info.pUserData = this;
    create(instance_, &info, nullptr, &messenger_);
}

VkBool32 VulkanInstance::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                    const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    auto* self = static_cast<VulkanInstance*>(user);
    const std::lock_guard lock(self->mutex_);
    self->messages_.emplace_back(data->pMessage);
    return VK_FALSE;
}

VulkanDeviceInfo describe(const InstanceApi& api, VkPhysicalDevice device, int index) {
    VkPhysicalDeviceDriverProperties driver{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    VkPhysicalDeviceProperties2 plain{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    api.vkGetPhysicalDeviceProperties2(device, &plain);
    VulkanDeviceInfo info;
    info.index = index;
    info.capabilities.name = plain.properties.deviceName;
    info.capabilities.type = device_type(plain.properties.deviceType);
    if (plain.properties.apiVersion < VK_API_VERSION_1_2) {
        info.missing = "Vulkan 1.2";
        return info;
    }
    properties.pNext = &driver;
    api.vkGetPhysicalDeviceProperties2(device, &properties);
    info.capabilities.driver = std::string(driver.driverName) + " " + driver.driverInfo;
    Features features;
    api.vkGetPhysicalDeviceFeatures2(device, &features.base);
    info.capabilities.f64 = features.base.features.shaderFloat64;
    VkPhysicalDeviceMemoryProperties memory;
    api.vkGetPhysicalDeviceMemoryProperties(device, &memory);
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            info.capabilities.memory_bytes =
                std::max<std::uint64_t>(info.capabilities.memory_bytes, memory.memoryHeaps[i].size);
    const auto need = [&](bool present, const char* name) {
        if (!present) info.missing += (info.missing.empty() ? "" : ", ") + std::string(name);
    };
    need(features.v12.bufferDeviceAddress, "bufferDeviceAddress");
    need(features.v12.scalarBlockLayout, "scalarBlockLayout");
    need(features.v12.timelineSemaphore, "timelineSemaphore");
    need(find_compute_family(api, device).has_value(), "a compute queue");
    return info;
}

Result<std::unique_ptr<VulkanDevice>> VulkanDevice::create(std::unique_ptr<VulkanInstance> instance,
                                                           const VulkanOptions& options) {
    const ExternalVulkan& external = options.external;
    auto self = std::make_unique<VulkanDevice>();
    self->instance = std::move(instance);
    const InstanceApi& api = self->instance->api();
    if (external.device) {
        self->owned = false;
        self->physical = static_cast<VkPhysicalDevice>(external.physical_device);
        self->handle = static_cast<VkDevice>(external.device);
        self->queue = static_cast<VkQueue>(external.queue);
        self->queue_family = external.queue_family;
        self->lock = external.lock;
        self->unlock = external.unlock;
        self->info = describe(api, self->physical, -1);
        self->info.capabilities.f64 = external.f64;
    } else {
        auto chosen = choose_device(*self->instance, options.device_index);
        if (!chosen) return chosen.error();
        self->info = *chosen;
        self->physical = self->instance->physical_devices()[self->info.index];
        self->queue_family = *find_compute_family(api, self->physical);
        const float priority = 1;
        VkDeviceQueueCreateInfo queue_info{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
        queue_info.queueFamilyIndex = self->queue_family;
        queue_info.queueCount = 1;
        queue_info.pQueuePriorities = &priority;
        Features features;
        features.v12.bufferDeviceAddress = VK_TRUE;
        features.v12.scalarBlockLayout = VK_TRUE;
        features.v12.timelineSemaphore = VK_TRUE;
        features.base.features.shaderFloat64 = self->info.capabilities.f64;
        VkDeviceCreateInfo device_info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                       .pNext = &features.base};
        device_info.queueCreateInfoCount = 1;
        device_info.pQueueCreateInfos = &queue_info;
        if (VkResult r = api.vkCreateDevice(self->physical, &device_info, nullptr, &self->handle);
            r != VK_SUCCESS)
            return vulkan_error(r, "vkCreateDevice");
    }
    if (!self->api.load(api, self->handle)) return no_device("the driver misses functions of Vulkan 1.2");
    if (self->owned) self->api.vkGetDeviceQueue(self->handle, self->queue_family, 0, &self->queue);
    api.vkGetPhysicalDeviceMemoryProperties(self->physical, &self->memory);
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    api.vkGetPhysicalDeviceProperties2(self->physical, &properties);
    self->limits = properties.properties.limits;
    return self;
}

VulkanDevice::~VulkanDevice() {
    if (owned && handle && api.vkDestroyDevice) api.vkDestroyDevice(handle, nullptr);
}

Result<std::vector<VulkanDeviceInfo>> list_vulkan_devices() {
    auto instance = VulkanInstance::create(false);
    if (!instance) return instance.error();
    std::vector<VulkanDeviceInfo> list;
    for (VkPhysicalDevice device : (*instance)->physical_devices())
        list.push_back(describe((*instance)->api(), device, static_cast<int>(list.size())));
    return list;
}

} // namespace hexopt::compute
